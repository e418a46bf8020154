//! The objective of one part of a step, and what it gives: the terms and the gradients.

use burn::module::AutodiffModule;
use burn::optim::GradientsParams;
use isomorph_model::{Objective, TrainBackend};

use crate::report::TermReport;

/// Takes the gradients of one network out of those of a graph.
type Collect<B> = Box<
    dyn FnOnce(&mut <B as burn::tensor::backend::AutodiffBackend>::Gradients) -> GradientsParams,
>;

/// An objective and the networks that it is to be derived by.
pub struct Posed<B: TrainBackend> {
    objective: Objective<B>,
    networks: Vec<Collect<B>>,
}

impl<B: TrainBackend> Posed<B> {
    /// An objective of no network yet.
    pub fn new(objective: Objective<B>) -> Self {
        Self {
            objective,
            networks: Vec::new(),
        }
    }

    /// Names the next network, the very replica that the objective was made with.
    #[must_use]
    pub fn by<M: AutodiffModule<B> + 'static>(mut self, net: M) -> Self {
        let collect =
            move |gradients: &mut B::Gradients| GradientsParams::from_module(gradients, &net);
        self.networks.push(Box::new(collect));
        self
    }

    /// The terms, read back to the host if `read` asks for them, and the gradients of the objective's
    /// share in the mean over `parts` parts, one for each network in the order of their naming.
    pub fn solve(self, parts: usize, read: bool) -> (Vec<TermReport>, Vec<GradientsParams>) {
        let terms = if read {
            reports(&self.objective)
        } else {
            Vec::new()
        };
        let Some(total) = self.objective.total() else {
            return (terms, Vec::new());
        };
        let share = if parts == 1 {
            total
        } else {
            total / parts as f64
        };
        let mut gradients = share.backward();
        let networks = self.networks.into_iter();
        (
            terms,
            networks.map(|collect| collect(&mut gradients)).collect(),
        )
    }
}

/// The gradients of all parts of a step.
#[derive(Debug)]
pub struct Slopes {
    /// By part, then by network.
    parts: Vec<Vec<Option<GradientsParams>>>,
}

impl Slopes {
    /// What the parts gave, in their order.
    pub fn new(parts: Vec<Vec<GradientsParams>>) -> Self {
        let optional = |part: Vec<GradientsParams>| part.into_iter().map(Some).collect();
        Self {
            parts: parts.into_iter().map(optional).collect(),
        }
    }

    /// The gradients of one network by part; none where the objective had no terms.
    pub fn take(&mut self, network: usize) -> Vec<GradientsParams> {
        let parts = self.parts.iter_mut();
        parts
            .filter_map(|part| part.get_mut(network)?.take())
            .collect()
    }
}

/// The terms of the whole step: the means of those of its equal parts.
pub(crate) fn mean_of(parts: &[Vec<TermReport>]) -> Vec<TermReport> {
    let Some((first, others)) = parts.split_first() else {
        return Vec::new();
    };
    let mean = |k: usize, of: fn(&TermReport) -> f64| {
        let sum: f64 = others.iter().map(|part| of(&part[k])).sum();
        (of(&first[k]) + sum) / parts.len() as f64
    };
    let terms = first.iter().enumerate();
    terms
        .map(|(k, term)| TermReport {
            name: term.name,
            raw: mean(k, |term| term.raw),
            weighted: mean(k, |term| term.weighted),
        })
        .collect()
}

fn reports<B: TrainBackend>(objective: &Objective<B>) -> Vec<TermReport> {
    let terms = objective.terms().iter().zip(objective.read());
    terms
        .map(|(term, raw)| TermReport {
            name: term.name,
            raw,
            weighted: raw * term.weight,
        })
        .collect()
}
