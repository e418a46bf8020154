//! The numbers of the field, and how a loop over them is run with the machine's widest instructions.
//!
//! The solver runs on f32; f64 is the same code, which tests take as the truth.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

use pulp::{Arch, Simd, WithSimd};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// f32 or f64.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + Send
    + Sync
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 1/2.
    const HALF: Self;

    /// The nearest number of this type.
    fn of(value: f64) -> Self;
    /// The same number in float64.
    fn wide(self) -> f64;
    /// The whole part of a number from 0 to 2^31 - 1.
    fn whole(self) -> i32;
    /// `self a + b`, rounded once.
    fn fused(self, a: Self, b: Self) -> Self;
    /// `a + factor b`.
    #[doc(hidden)]
    fn add_eight(with: impl Fuse, a: [Self; 8], factor: Self, b: [Self; 8]) -> [Self; 8];
}

macro_rules! real {
    ($type:ty, $of:expr, $add:expr) => {
        impl Real for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const HALF: Self = 0.5;

            #[inline(always)]
            fn of(value: f64) -> Self {
                $of(value)
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn whole(self) -> i32 {
                self as i32
            }

            #[inline(always)]
            fn fused(self, a: Self, b: Self) -> Self {
                self.mul_add(a, b)
            }

            #[inline(always)]
            fn add_eight(f: impl Fuse, a: [Self; 8], factor: Self, b: [Self; 8]) -> [Self; 8] {
                $add(f, a, factor, b)
            }
        }
    };
}
real!(f32, |value| value as f32, Fuse::add_f32);
real!(f64, |value| value, add_f64);

#[inline(always)]
fn add_f64(f: impl Fuse, a: [f64; 8], factor: f64, b: [f64; 8]) -> [f64; 8] {
    let mut out = a;
    for l in 0..8 {
        out[l] = f.multiply_add(factor, b[l], a[l]);
    }
    out
}

/// The vector instructions of the machine. Machines without a fused product would call a slow function for
/// one, so that it is left to them.
#[doc(hidden)]
pub trait Fuse: Copy {
    /// `a b + c`.
    fn multiply_add<R: Real>(self, a: R, b: R, c: R) -> R;

    /// `a + factor b`.
    #[inline(always)]
    fn add_f32(self, a: [f32; 8], factor: f32, b: [f32; 8]) -> [f32; 8] {
        let mut out = a;
        for l in 0..8 {
            out[l] = self.multiply_add(factor, b[l], a[l]);
        }
        out
    }
}

#[derive(Clone, Copy)]
struct Plain;

impl Fuse for Plain {
    #[inline(always)]
    fn multiply_add<R: Real>(self, a: R, b: R, c: R) -> R {
        a * b + c
    }
}

#[derive(Clone, Copy)]
struct Fused;

impl Fuse for Fused {
    #[inline(always)]
    fn multiply_add<R: Real>(self, a: R, b: R, c: R) -> R {
        a.fused(b, c)
    }
}

/// AVX2. Left to itself, the compiler takes scalars for half of a cell's sums.
#[cfg(target_arch = "x86_64")]
impl Fuse for pulp::x86::V3 {
    #[inline(always)]
    fn multiply_add<R: Real>(self, a: R, b: R, c: R) -> R {
        a.fused(b, c)
    }

    #[inline(always)]
    fn add_f32(self, a: [f32; 8], factor: f32, b: [f32; 8]) -> [f32; 8] {
        let factor = self.splat_f32x8(factor);
        pulp::cast(self.mul_add_f32x8(factor, pulp::cast(b), pulp::cast(a)))
    }
}

/// A loop that is compiled once for each set of vector instructions. All that it calls must be inlined:
/// a call would run on the narrowest vectors.
pub(crate) trait Kernel {
    /// Runs the loop.
    fn run<F: Fuse>(self, f: F);
}

struct Dispatched<K>(K);

impl<K: Kernel> WithSimd for Dispatched<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        #[cfg(target_arch = "x86_64")]
        {
            let simd: &dyn std::any::Any = &simd;
            if let Some(&avx512) = simd.downcast_ref::<pulp::x86::V4>() {
                return self.0.run::<pulp::x86::V3>(*avx512);
            }
            if let Some(&avx2) = simd.downcast_ref::<pulp::x86::V3>() {
                return self.0.run(avx2);
            }
        }
        if S::IS_SCALAR {
            self.0.run(Plain);
        } else {
            self.0.run(Fused);
        }
    }
}

/// Runs a kernel with the widest instructions of the machine.
pub(crate) fn run(kernel: impl Kernel) {
    Arch::new().dispatch(Dispatched(kernel));
}
