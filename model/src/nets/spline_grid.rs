//! The grid of a spline as a constant of its module: not trained, but a part of the record, so that a
//! checkpoint says where its coefficients stand.

use std::marker::PhantomData;

use burn::module::{
    AutodiffModule, Content, Devices, Module, ModuleDisplay, ModuleDisplayDefault, ModuleMapper,
    ModuleVisitor,
};
use burn::record::{PrecisionSettings, Record};
use burn::tensor::backend::{AutodiffBackend, Backend};
use isomorph_spline::Grid;
use serde::{Deserialize, Serialize};

/// A box of cubic cells, in normalised units. Each axis has two nodes more than cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplineGrid {
    /// The corner of the first cell.
    pub lower: [f32; 3],
    /// The edge of a cell.
    pub spacing: f32,
    /// Cells along each axis.
    pub cells: [u32; 3],
}

impl SplineGrid {
    /// Nodes along each axis.
    pub fn nodes(&self) -> [usize; 3] {
        self.of_field().nodes()
    }

    /// The same grid as the package `isomorph-spline` has it.
    pub(crate) fn of_field(self) -> Grid {
        let Self {
            lower,
            spacing,
            cells,
        } = self;
        Grid {
            lower,
            spacing,
            cells,
        }
    }
}

impl From<Grid> for SplineGrid {
    fn from(grid: Grid) -> Self {
        let Grid {
            lower,
            spacing,
            cells,
        } = grid;
        Self {
            lower,
            spacing,
            cells,
        }
    }
}

impl<B: Backend> Record<B> for SplineGrid {
    type Item<S: PrecisionSettings> = Self;

    fn into_item<S: PrecisionSettings>(self) -> Self::Item<S> {
        self
    }

    fn from_item<S: PrecisionSettings>(item: Self::Item<S>, _: &B::Device) -> Self {
        item
    }
}

/// The grid as a part of a module of backend `B`.
///
/// burn leaves what has no backend in its type out of the record.
#[derive(Clone, Debug)]
pub struct GridOf<B: Backend> {
    /// The grid.
    pub(crate) grid: SplineGrid,
    backend: PhantomData<B>,
}

impl<B: Backend> From<SplineGrid> for GridOf<B> {
    fn from(grid: SplineGrid) -> Self {
        Self {
            grid,
            backend: PhantomData,
        }
    }
}

impl<B: Backend> Module<B> for GridOf<B> {
    type Record = SplineGrid;

    fn collect_devices(&self, devices: Devices<B>) -> Devices<B> {
        devices
    }

    fn fork(self, _: &B::Device) -> Self {
        self
    }

    fn to_device(self, _: &B::Device) -> Self {
        self
    }

    fn visit<V: ModuleVisitor<B>>(&self, _: &mut V) {}

    fn map<M: ModuleMapper<B>>(self, _: &mut M) -> Self {
        self
    }

    fn load_record(self, record: Self::Record) -> Self {
        record.into()
    }

    fn into_record(self) -> Self::Record {
        self.grid
    }
}

impl<B: AutodiffBackend> AutodiffModule<B> for GridOf<B> {
    type InnerModule = GridOf<B::InnerBackend>;

    fn valid(&self) -> Self::InnerModule {
        self.grid.into()
    }

    fn from_inner(module: Self::InnerModule) -> Self {
        module.grid.into()
    }
}

impl<B: Backend> ModuleDisplayDefault for GridOf<B> {
    fn content(&self, content: Content) -> Option<Content> {
        content.add_single(&format!("{:?}", self.grid)).optional()
    }
}

impl<B: Backend> ModuleDisplay for GridOf<B> {}
