//! Points and times of the host as tensors.

use burn::tensor::backend::Backend;
use burn::tensor::{Tensor, TensorData};

/// Points as a tensor `[n, 3]`.
pub fn rows<B: Backend>(points: &[[f32; 3]], device: &B::Device) -> Tensor<B, 2> {
    let data = TensorData::new(points.as_flattened().to_vec(), [points.len(), 3]);
    Tensor::from_data(data, device)
}

/// Values as a tensor `[n, 1]`.
pub fn column<B: Backend>(values: &[f32], device: &B::Device) -> Tensor<B, 2> {
    Tensor::from_data(TensorData::new(values.to_vec(), [values.len(), 1]), device)
}
