//! The cost of forward dynamics by articulated bodies: operations, counted, and no allocation.

use std::cell::Cell;
use std::cmp::Ordering;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use allocation_counter::measure;
use vpm_core::beam::{Component, Level};
use vpm_core::data::Data;
use vpm_core::dynamics::articulated::{Shift, articulated, shifted};
use vpm_core::dynamics::flexible;
use vpm_core::model::Model;
use vpm_core::{Result, Scalar};

use crate::common::element_arm;
use crate::common::trees;

thread_local! {
    static OPERATIONS: Cell<u64> = const { Cell::new(0) };
}

/// A number that counts what is done with it, as a recorder of operations would: nothing for constants and for zeros and ones.
#[derive(Clone, Copy, Debug, Default)]
struct Counting {
    value: f64,
    varies: bool,
}

fn done(value: f64) -> Counting {
    OPERATIONS.with(|count| count.set(count.get() + 1));
    Counting { value, varies: true }
}

impl Counting {
    fn is(self, value: f64) -> bool {
        !self.varies && self.value == value
    }
    /// A function of one number.
    fn function(self, f: impl Fn(f64) -> f64) -> Self {
        if self.varies { done(f(self.value)) } else { Self::from(f(self.value)) }
    }
    /// A function of two, of which neither is trivial.
    fn of_both(self, other: Self, value: f64) -> Self {
        if self.varies || other.varies { done(value) } else { Self::from(value) }
    }
}

impl From<f64> for Counting {
    fn from(value: f64) -> Self {
        Self { value, varies: false }
    }
}
impl PartialEq for Counting {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}
impl PartialOrd for Counting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}
impl Add for Counting {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        match (self.is(0.0), other.is(0.0)) {
            (true, _) => other,
            (_, true) => self,
            _ => self.of_both(other, self.value + other.value),
        }
    }
}
impl Neg for Counting {
    type Output = Self;
    fn neg(self) -> Self {
        self.function(|x| -x)
    }
}
impl Sub for Counting {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        match (self.is(0.0), other.is(0.0)) {
            (_, true) => self,
            (true, _) => -other,
            _ => self.of_both(other, self.value - other.value),
        }
    }
}
impl Mul for Counting {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        match () {
            () if self.is(0.0) || other.is(0.0) => Self::from(0.0),
            () if self.is(1.0) => other,
            () if other.is(1.0) => self,
            () => self.of_both(other, self.value * other.value),
        }
    }
}
impl Div for Counting {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if self.is(0.0) { self } else { self.of_both(other, self.value / other.value) }
    }
}
macro_rules! with_f64 {
    ($($operation:ident $name:ident),*) => { $(
        impl $operation<f64> for Counting {
            type Output = Self;
            fn $name(self, other: f64) -> Self {
                $operation::$name(self, Self::from(other))
            }
        }
    )* };
}
with_f64!(Add add, Sub sub, Mul mul, Div div);
macro_rules! assigning {
    ($($operation:ident $name:ident $by:ident),*) => { $(
        impl $operation for Counting {
            fn $name(&mut self, other: Self) {
                *self = self.$by(other);
            }
        }
    )* };
}
assigning!(AddAssign add_assign add, SubAssign sub_assign sub, MulAssign mul_assign mul, DivAssign div_assign div);
impl Sum for Counting {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), Add::add)
    }
}
impl Scalar for Counting {
    fn re(&self) -> f64 {
        self.value
    }
    fn is_finite(self) -> bool {
        self.value.is_finite()
    }
    fn sqrt(self) -> Self {
        self.function(f64::sqrt)
    }
    fn exp(self) -> Self {
        self.function(f64::exp)
    }
    fn exp_m1(self) -> Self {
        self.function(f64::exp_m1)
    }
    fn ln(self) -> Self {
        self.function(f64::ln)
    }
    fn sin_cos(self) -> (Self, Self) {
        (self.function(f64::sin), self.function(f64::cos))
    }
    fn tanh(self) -> Self {
        self.function(f64::tanh)
    }
    fn atan(self) -> Self {
        self.function(f64::atan)
    }
    fn powi(self, exponent: i32) -> Self {
        self.function(|x| x.powi(exponent))
    }
}

fn counted(work: impl FnOnce()) -> f64 {
    OPERATIONS.with(|count| count.set(0));
    work();
    OPERATIONS.with(|count| count.get() as f64)
}

/// Operations of accelerations, of the same with an implicit step, and of those by a mass matrix.
#[cfg(test)]
fn operations(elements: usize, deforms: &[Component]) -> Result<[f64; 3]> {
    let tree = trees::model::<Counting>(&element_arm::arm(Level::Elements(elements), deforms))?;
    let (n, mut data) = (tree.n_coordinates(), Data::new(&tree));
    let state = |size: f64| -> Vec<Counting> {
        (0..n).map(|k| Counting { value: size * (1.0 + k as f64).sin(), varies: true }).collect()
    };
    let (q, v, tau) = (state(0.1), state(0.3), state(1.0));
    let shift = Shift { reach: Counting::from(1e-3), resistances: &q[..2] };
    Ok([
        counted(|| {
            articulated(&tree, &mut data, &q, &v, &tau);
        }),
        counted(|| {
            shifted(&tree, &mut data, (&q, &v), &tau, shift);
        }),
        counted(|| {
            flexible::terms(&tree, &mut data, &q, &v);
            flexible::solve(&tree, &mut data, &q, &v, &tau);
        }),
    ])
}

#[test]
fn operations_grow_with_the_number_of_elements() -> Result<()> {
    use Component::{BendingX, BendingY, Torsion};
    for deforms in [&[BendingX][..], &[BendingX, BendingY, Torsion]] {
        let mut all = Vec::new();
        for elements in [1, 2, 5, 10, 20, 40] {
            let [plain, implicit, dense] = operations(elements, deforms)?;
            println!("{elements} elements of {}: {plain}, implicit {implicit}, dense {dense}", deforms.len());
            all.push([plain, implicit]);
        }
        for kind in [0, 1] {
            let each = (all[5][kind] - all[4][kind]) / 20.0;
            // The elements at root and tip differ from the others, all others are alike.
            assert_eq!(all[4][kind] - all[3][kind], 10.0 * each);
            assert!(all[5][kind] / all[3][kind] < 4.0_f64.powf(1.3));
        }
    }
    Ok(())
}

#[test]
fn sweeps_allocate_nothing() -> Result<()> {
    let parts = element_arm::arm(Level::Elements(5), &[Component::BendingX, Component::Torsion]);
    let tree = Model::<f64>::assemble(parts)?;
    let (n, mut data) = (tree.n_coordinates(), Data::new(&tree));
    let [q, v, tau] = [0.1, 0.2, 0.3].map(|value| vec![value; n]);
    let found = measure(|| {
        articulated(&tree, &mut data, &q, &v, &tau);
        shifted(&tree, &mut data, (&q, &v), &tau, Shift { reach: 1e-3, resistances: &[0.1, 0.2] });
    });
    assert_eq!(found.count_total, 0);
    Ok(())
}
