//! What `train` and `resume` share: the run itself, and the surfaces that it ends with.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Result;
use isomorph_model::{ModelBackend, TrainBackend};

use super::trained;
use super::{BackendArgs, Ending, even_times, stop_on_interrupt};
use crate::backend::{self, Task};
use crate::learner::checkpoint::Checkpoint;
use crate::learner::event::Event;
use crate::learner::{Learner, Outcome};
use crate::picture;
use crate::recipe::Recipe;
use crate::report::Reporter;
use crate::run_directory::RunDirectory;
use crate::shape::Pair;
use crate::surface::frames::{Frame, FrameOptions, write_frames};
use crate::surface::trained::Trained;
use crate::surface::write::SurfaceFormat;

/// One run, from its first step or from a checkpoint.
pub(super) struct Training {
    pub recipe: Recipe,
    pub pair: Pair,
    pub run: RunDirectory,
    pub checkpoint: Option<Checkpoint>,
    pub reporter: Reporter,
}

impl Training {
    /// Trains to the end, then writes the surfaces that the recipe asks for.
    pub(super) fn start(self, place: &BackendArgs) -> Result<Ending> {
        let stop = stop_on_interrupt()?;
        let task = Train {
            training: self,
            stop,
        };
        backend::run(place.backend, place.device.as_deref(), task)?
    }
}

struct Train {
    training: Training,
    stop: Arc<AtomicBool>,
}

impl Task for Train {
    type Output = Result<Ending>;

    fn run<B: TrainBackend>(self, device: B::Device) -> Self::Output {
        let Training {
            recipe,
            pair,
            run,
            checkpoint,
            mut reporter,
        } = self.training;
        let frame = trained::Frame {
            normalisation: pair.normalisation,
            bounds: pair.bounds,
        };
        let (result, known) = (recipe.result.clone(), recipe.clone());
        let mut learner = match &checkpoint {
            None => Learner::<B>::new(recipe, pair, device.clone())?,
            Some(checkpoint) => Learner::<B>::resume(recipe, pair, device.clone(), checkpoint)?,
        };
        let mut emit = |event: Event| reporter.handle(&event);
        let outcome = learner.run(&run.checkpoints(), &self.stop, &mut emit)?;
        if outcome == Outcome::Interrupted {
            return Ok(Ending::Interrupted);
        }
        if result.frames == 0 {
            return Ok(Ending::Done);
        }
        let trained = trained::trained(learner.method(), &known, frame, device)?;
        let options = FrameOptions {
            times: even_times(result.frames),
            resolution: result.resolution,
            format: SurfaceFormat::Ply,
            carry: None,
            folder: run.meshes(),
        };
        write_and_show(&trained, &options, &self.stop, &mut reporter)
    }
}

/// Writes frames, reports each, and draws them all into one picture beside them.
pub(super) fn write_and_show<B: ModelBackend>(
    trained: &Trained<B>,
    options: &FrameOptions,
    stop: &AtomicBool,
    reporter: &mut Reporter,
) -> Result<Ending> {
    reporter.handle(&Event::Extracting {
        frames: options.times.len(),
    })?;
    let frames = write_frames(trained, options, |frame| {
        reporter.handle(&extracted(frame, options))?;
        Ok(!stop.load(Ordering::Relaxed))
    })?;
    if frames.len() < options.times.len() {
        return Ok(Ending::Interrupted);
    }
    show(&frames, options)?;
    Ok(Ending::Done)
}

fn extracted(frame: &Frame, options: &FrameOptions) -> Event {
    Event::Extracted {
        time: frame.entry.time,
        path: options.folder.join(&frame.entry.surface),
        vertices: frame.mesh.vertices.len(),
        triangles: frame.mesh.triangles.len(),
        components: frame.components,
        left_out: frame.left_out,
        consistency: frame.entry.consistency,
        touches_box: frame.touches_box,
    }
}

/// At most this many surfaces fit side by side and can still be told apart.
const SHOWN: usize = 9;

/// `preview.png`: up to nine of the frames, evenly chosen.
fn show(frames: &[Frame], options: &FrameOptions) -> io::Result<()> {
    let count = frames.len().min(SHOWN);
    let chosen = (0..count).map(|k| match count {
        1 => &frames[0],
        _ => &frames[k * (frames.len() - 1) / (count - 1)],
    });
    let panels: Vec<_> = chosen
        .filter(|frame| !frame.mesh.triangles.is_empty())
        .map(|frame| picture::Frame {
            vertices: &frame.mesh.vertices,
            triangles: &frame.mesh.triangles,
            time: frame.entry.time as f32,
        })
        .collect();
    if panels.is_empty() {
        return Ok(());
    }
    let path = options.folder.join("preview.png");
    picture::strip(&panels, &picture::View::default(), &path).map_err(io::Error::other)
}
