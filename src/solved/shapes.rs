//! The shapes that a field carries.

use std::sync::Arc;

use crate::shape::{Solid, SolidParts};

/// Two shapes that are arranged for queries, or more that are not yet.
#[derive(Clone)]
pub(super) enum Shapes {
    /// Two.
    Pair([Arc<Solid>; 2]),
    /// Three or more; arranging all of them would take most of a run's memory.
    Many(Arc<[SolidParts]>),
}

impl Shapes {
    /// The shapes of their parts; in error, the number of the first that fit together to none.
    pub(super) fn of(parts: Vec<SolidParts>) -> Result<Self, usize> {
        let parts: Vec<SolidParts> = match <[SolidParts; 2]>::try_from(parts) {
            Ok([first, second]) => {
                // Arranging the triangles of one shape takes one core.
                let (first, second) = rayon::join(|| Solid::new(first), || Solid::new(second));
                let arranged = |k: usize, solid: Option<Solid>| solid.map(Arc::new).ok_or(k);
                return Ok(Self::Pair([arranged(0, first)?, arranged(1, second)?]));
            }
            Err(many) => many,
        };
        match parts.iter().position(|parts| !parts.is_sound()) {
            Some(k) => Err(k),
            None => Ok(Self::Many(parts.into())),
        }
    }

    /// What they are made from.
    pub(super) fn parts(&self) -> Vec<&SolidParts> {
        match self {
            Self::Pair(pair) => pair.iter().map(|solid| solid.parts()).collect(),
            Self::Many(many) => many.iter().collect(),
        }
    }
}
