//! temporary
mod camera; pub mod picture; mod raster;
use crate::learner::event::Event; use crate::run_directory::RunDirectory;
pub enum Verbosity { Quiet, Normal }
pub struct Reporter { last: std::time::Instant }
impl Reporter { pub fn new(_: &RunDirectory, _: Option<usize>, _: Verbosity) -> std::io::Result<Self> { Ok(Self{last: std::time::Instant::now()}) }
 pub fn handle(&mut self, e: &Event) -> std::io::Result<()> { match e { Event::Tick{..} => {}, Event::Step(s) => if self.last.elapsed().as_secs_f64() > 5.0 { self.last = std::time::Instant::now(); eprintln!("{} {:.1}s {:?} {:.3} {}", s.step, s.seconds, s.phase, s.total, s.terms.iter().map(|t| format!("{}={:.4}", t.name, t.raw)).collect::<Vec<_>>().join(" ")) }, e => eprintln!("{e:?}") } Ok(()) } }
