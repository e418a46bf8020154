//! Points and times of the host as tensors, and tensors as numbers of the host.

use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};

/// Points as a tensor `[n, 3]`.
pub(crate) fn rows<B: Backend, const N: usize>(
    points: &[[f32; N]],
    device: &B::Device,
) -> Tensor<B, 2> {
    let data = TensorData::new(points.as_flattened().to_vec(), [points.len(), N]);
    Tensor::from_data(data, device)
}

/// Values as a tensor `[n, 1]`.
pub(crate) fn column<B: Backend>(values: &[f32], device: &B::Device) -> Tensor<B, 2> {
    Tensor::from_data(TensorData::new(values.to_vec(), [values.len(), 1]), device)
}

/// The values of a tensor, row by row.
pub(crate) fn host<B: Backend>(tensor: Tensor<B, 2>) -> Vec<f32> {
    tensor.into_data().iter::<f32>().collect()
}
