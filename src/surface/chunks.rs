//! Networks at many points: a chunk at a time, on a processor on all of its cores.

use isomorph_model::ModelBackend;

use crate::workers::Workers;

/// Points per evaluation of a network by one core: the values of a layer of 128 stay in its cache.
const HOST_CHUNK: usize = 1024;

/// Points per evaluation on a device where larger batches are only better.
const DEVICE_CHUNK: usize = 1 << 16;

/// What `map` makes of each chunk of the points, in their order.
pub(super) fn in_chunks<B: ModelBackend, P: Sync, T: Send>(
    points: &[P],
    map: impl Fn(&[P]) -> T + Sync,
) -> Vec<T> {
    if B::POINTS_AT_A_TIME.is_none() {
        return points.chunks(DEVICE_CHUNK).map(map).collect();
    }
    let chunks: Vec<_> = points.chunks(HOST_CHUNK).collect();
    Workers::shared().map(chunks.len(), |k| map(chunks[k]))
}
