/// Arguments of an action: at most eight numbers.
///
/// Implemented for `()`, `f64`, arrays and tuples; for a struct of `f64` fields with
/// [`arguments!`](crate::arguments).
pub trait Arguments: Copy {
    /// Number of arguments.
    const LENGTH: usize;

    /// Writes them to a slice of this length.
    fn write(self, numbers: &mut [f64]);

    /// Reads them from a slice of this length.
    fn read(numbers: &[f64]) -> Self;
}

impl Arguments for () {
    const LENGTH: usize = 0;

    fn write(self, _: &mut [f64]) {}

    fn read(_: &[f64]) -> Self {}
}

impl Arguments for f64 {
    const LENGTH: usize = 1;

    fn write(self, numbers: &mut [f64]) {
        numbers[0] = self;
    }

    fn read(numbers: &[f64]) -> Self {
        numbers[0]
    }
}

impl<const N: usize> Arguments for [f64; N] {
    const LENGTH: usize = N;

    fn write(self, numbers: &mut [f64]) {
        numbers[..N].copy_from_slice(&self);
    }

    fn read(numbers: &[f64]) -> Self {
        std::array::from_fn(|i| numbers[i])
    }
}

macro_rules! tuple {
    ($($name:ident $index:tt),+) => {
        impl<$($name: Arguments),+> Arguments for ($($name,)+) {
            const LENGTH: usize = 0 $(+ $name::LENGTH)+;

            fn write(self, numbers: &mut [f64]) {
                let rest = numbers;
                $(
                    let (own, rest) = rest.split_at_mut($name::LENGTH);
                    self.$index.write(own);
                )+
                let _ = rest;
            }

            fn read(numbers: &[f64]) -> Self {
                let rest = numbers;
                $(
                    let (own, rest) = rest.split_at($name::LENGTH);
                    #[allow(non_snake_case)]
                    let $name = $name::read(own);
                )+
                let _ = rest;
                ($($name,)+)
            }
        }
    };
}
tuple!(A 0);
tuple!(A 0, B 1);
tuple!(A 0, B 1, C 2);
tuple!(A 0, B 1, C 2, D 3);
tuple!(A 0, B 1, C 2, D 3, E 4);
tuple!(A 0, B 1, C 2, D 3, E 4, F 5);

/// Defines a struct of arguments of an action: `arguments!(Goal { x, y });`.
/// Its fields are [`Arguments`](crate::Arguments), such as `f64`.
#[macro_export]
macro_rules! arguments {
    ($name:ident { $($field:ident: $kind:ty),+ $(,)? }) => {
        impl $crate::Arguments for $name {
            const LENGTH: usize = <($($kind,)+) as $crate::Arguments>::LENGTH;

            fn write(self, numbers: &mut [f64]) {
                $crate::Arguments::write(($(self.$field,)+), numbers);
            }

            fn read(numbers: &[f64]) -> Self {
                let ($($field,)+) = <($($kind,)+) as $crate::Arguments>::read(numbers);
                Self { $($field),+ }
            }
        }
    };
    ($name:ident { $($field:ident),+ $(,)? }) => {
        $crate::arguments!($name { $($field: $crate::arguments!(@number $field)),+ });
    };
    (@number $field:ident) => { f64 };
}
