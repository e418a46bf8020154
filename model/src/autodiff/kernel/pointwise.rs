//! What an activation is to the kernels, and how a loop over plain memory becomes vector instructions.

use pulp::Arch;

/// Adding it to a number of up to 2^22 rounds that to a whole one, whose bits are then the lowest of the
/// sum; subtracting it again leaves the whole number.
pub(super) const ROUND: f32 = 12_582_912.0;

/// A loop that is compiled once for each set of vector instructions, and for each function in `<>`; `arch`
/// is the set to take.
///
/// A closure would do, were the compiler bound to inline it: where it does not, all of it runs on the
/// narrowest vectors.
macro_rules! vectorised {
    (
        $(#[$doc:meta])*
        fn $name:ident $(<$function:ident: $bound:path>)? ($($argument:ident: $type:ty),*) $body:block
    ) => {
        $(#[$doc])*
        fn $name<'a $(, $function: $bound)?>(arch: Arch, $($argument: $type),*) {
            struct Pass<'a $(, $function: $bound)?> {
                $($argument: $type),*
            }
            impl<'a $(, $function: $bound)?> NullaryFnOnce for Pass<'a $(, $function)?> {
                type Output = ();

                #[inline(always)]
                fn call(self) {
                    let Self { $($argument),* } = self;
                    $body
                }
            }
            arch.dispatch(Pass { $($argument),* });
        }
    };
}
pub(super) use vectorised;

/// An activation whose second and third derivatives follow from its value and its slope.
pub(super) trait Pointwise: Copy {
    /// Turns rows of inputs, which both hold, into values and slopes at the input plus the bias, of which
    /// there is one per column.
    fn evaluate(self, arch: Arch, bias: &[f32], value: &mut [f32], slope: &mut [f32]);

    /// `s''`.
    fn curvature(self, value: f32, slope: f32) -> f32;

    /// `s'''`.
    fn third(self, value: f32, slope: f32) -> f32;
}
