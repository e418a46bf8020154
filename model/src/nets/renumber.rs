//! Numbers of parameters: those of one network count from 1, and two networks in one module are set apart.
//!
//! Gradients and optimiser states are kept by these numbers. Two parameters of one number would share both,
//! without any error: one network would be moved by the gradient of the other. So each module of several
//! networks adds an offset to the numbers of the later ones, and [`apart`] refuses a module in which the
//! offset is too small. The offsets stand in checkpoints and do not change.

use std::collections::HashSet;

use burn::module::{Module, ModuleMapper, Param, ParamId, list_param_ids};
use burn::tensor::Tensor;
use burn::tensor::backend::Backend;

/// The module with `offset` added to the number of each parameter.
pub(crate) fn renumbered<B: Backend, M: Module<B>>(module: M, offset: u64) -> M {
    struct Renumber(u64);
    impl<B: Backend> ModuleMapper<B> for Renumber {
        fn map_float<const D: usize>(&mut self, param: Param<Tensor<B, D>>) -> Param<Tensor<B, D>> {
            let id = ParamId::from(param.id.val() + self.0);
            Param::initialized(id, param.val())
        }
    }
    module.map(&mut Renumber(offset))
}

/// The module, in which no two parameters have one number; `name` is its type's.
///
/// # Panics
/// If two parameters have the same number.
pub(crate) fn apart<B: Backend, M: Module<B>>(module: M, name: &str) -> M {
    let mut seen = HashSet::new();
    for id in list_param_ids(&module) {
        assert!(
            seen.insert(id),
            "{name}: two parameters have the number {}: a network has more parameters than there are \
             numbers before the next one begins; give it fewer layers",
            id.val()
        );
    }
    module
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::autodiff::Activation;
    use crate::nets::{ImplicitNet, ImplicitNetConfig};
    use crate::testing::{Plain, host};

    /// Two hidden layers and an output: six parameters, numbered from 1.
    fn net() -> ImplicitNet<Plain> {
        let config = ImplicitNetConfig {
            depth: 2,
            width: 4,
            activation: Activation::Sine { omega: 1.0 },
            frequencies: 0,
            skip: 0,
            sphere_radius: 0.4,
        };
        config.init(1, &Default::default())
    }

    fn numbers<M: Module<Plain>>(module: &M) -> Vec<u64> {
        list_param_ids(module).iter().map(|id| id.val()).collect()
    }

    #[test]
    fn an_offset_moves_the_numbers_and_keeps_the_weights() {
        let (before, after) = (net(), renumbered(net(), 100));
        assert_eq!(numbers(&before), [1, 2, 3, 4, 5, 6]);
        assert_eq!(numbers(&after), [101, 102, 103, 104, 105, 106]);
        let weights = |net: &ImplicitNet<Plain>| host(net.mlp.output().weight.val());
        assert_eq!(weights(&before), weights(&after));
    }

    #[test]
    fn networks_that_are_just_apart_are_accepted() {
        let both = apart(vec![net(), renumbered(net(), 6)], "Both");
        assert_eq!(numbers(&both).len(), 12);
    }

    #[test]
    #[should_panic(expected = "Both: two parameters have the number 6")]
    fn networks_whose_numbers_meet_are_refused() {
        apart(vec![net(), renumbered(net(), 5)], "Both");
    }
}
