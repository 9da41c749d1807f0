//! Sine and cosine of one argument as instructions.
//!
//! Sources: the argument less the nearest multiple k of pi/2, which stands in three parts (Cody & Waite 1980, "Software Manual
//! for the Elementary Functions", chapter 8; with fused products after Boldo, Daumas & Li 2009, IEEE Trans. Computers 58); the
//! polynomials of `__kernel_sin` and `__kernel_cos` (FDLIBM 5.3, Sun Microsystems 1993), summed in pairs (Estrin 1960).

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{InstBuilder, Value, types};

use super::emit::Emitter;

/// pi/2 in three parts, each the rounded rest; together right to 2^-161.
const QUARTER: [f64; 3] = [FRAC_PI_2, 6.123233995736766e-17, -1.4973849048591698e-33];
/// 1.5 times 2^52: the sum with it keeps the nearest integer in its last bits.
const TO_INTEGER: f64 = 6755399441055744.0;
/// 2^974: makes infinity of 2^50 and beyond.
const TO_INFINITY: f64 = f64::from_bits((974 + 1023) << 52);
/// sin r = r + r^3 (S1 + S2 r^2 + ..), |r| <= pi/4, to 2^-58.
const SINE: [f64; 6] = [
    -0.16666666666666632,
    0.00833333333332249,
    -0.0001984126982985795,
    2.7557313707070068e-06,
    -2.5050760253406863e-08,
    1.58969099521155e-10,
];
/// cos r = 1 - r^2/2 + r^4 (C1 + C2 r^2 + ..), likewise.
const COSINE: [f64; 6] = [
    0.0416666666666666,
    -0.001388888888887411,
    2.480158728947673e-05,
    -2.7557314351390663e-07,
    2.087572321298175e-09,
    -1.1359647557788195e-11,
];

impl Emitter<'_> {
    /// Emits the trigonometry of one argument: sine and cosine. Not a number from 2^50 on, where neighbouring arguments
    /// lie more than 0.1 apart.
    pub(super) fn sine_cosine(&mut self, x: Value) -> Option<[Value; 2]> {
        let (per_quarter, to_integer) = (self.constant(FRAC_2_PI)?, self.constant(TO_INTEGER)?);
        let marked = self.code.ins().fma(x, per_quarter, to_integer);
        let to_integer = self.constant(TO_INTEGER)?;
        let k = self.code.ins().fsub(marked, to_integer);
        let r = self.reduced(x, k)?;
        let z = self.code.ins().fmul(r, r);
        let z_squared = self.code.ins().fmul(z, z);
        let sine = self.polynomial(SINE, z, z_squared)?;
        let cube = self.code.ins().fmul(r, z);
        let sine = self.code.ins().fma(cube, sine, r);
        let cosine = self.polynomial(COSINE, z, z_squared)?;
        let half = self.constant(-0.5)?;
        let cosine = self.code.ins().fma(cosine, z, half);
        let one = self.constant(1.0)?;
        let cosine = self.code.ins().fma(cosine, z, one);
        Some(self.in_quadrant(marked, sine, cosine))
    }

    /// Reduced argument of trigonometry: x - k pi/2.
    fn reduced(&mut self, x: Value, k: Value) -> Option<Value> {
        let less = self.code.ins().fneg(k);
        let [first, second, third] = QUARTER;
        let part = self.constant(first)?;
        // Exact: both are multiples of 2^-52 and the difference is below 1.
        let r = self.code.ins().fma(less, part, x);
        let part = self.constant(second)?;
        let r = self.code.ins().fma(less, part, r);
        // Zero, or not a number where x is too large.
        let most = self.constant(TO_INFINITY)?;
        let large = self.code.ins().fmul(x, most);
        let zero = self.constant(0.0)?;
        let nothing = self.code.ins().fmul(large, zero);
        let part = self.constant(third)?;
        let rest = self.code.ins().fma(less, part, nothing);
        Some(self.code.ins().fadd(r, rest))
    }

    /// Polynomial for trigonometry: c0 + c1 z + .. + c5 z^5.
    fn polynomial(&mut self, [c0, c1, c2, c3, c4, c5]: [f64; 6], z: Value, z_squared: Value) -> Option<Value> {
        let mut pair = |low: f64, high: f64| {
            let (low, high) = (self.constant(low)?, self.constant(high)?);
            Some(self.code.ins().fma(high, z, low))
        };
        let (first, second, third) = (pair(c0, c1)?, pair(c2, c3)?, pair(c4, c5)?);
        let sum = self.code.ins().fma(third, z_squared, second);
        Some(self.code.ins().fma(sum, z_squared, first))
    }

    /// Trigonometry in a quadrant: sine and cosine of r + k pi/2. The last two bits of `marked` are those of k.
    fn in_quadrant(&mut self, marked: Value, sine: Value, cosine: Value) -> [Value; 2] {
        let one = self.mask(1);
        let marked = self.wide(marked);
        let k = self.seen_as(types::I64X2, marked);
        let last = self.code.ins().band(k, one);
        let odd = self.code.ins().icmp(IntCC::Equal, last, one);
        let next = self.code.ins().iadd(k, one);
        let [sine, cosine] = [sine, cosine].map(|value| {
            let value = self.wide(value);
            self.seen_as(types::I64X2, value)
        });
        let turned = [self.code.ins().bitselect(odd, cosine, sine), self.code.ins().bitselect(odd, sine, cosine)];
        // The sine turns its sign where the second bit of k is one, the cosine where that of k + 1 is.
        let sign = self.mask(1 << 63);
        let mut signed = |value: Value, k: Value| {
            let shifted = self.code.ins().ishl_imm_u(k, 62);
            let bit = self.code.ins().band(shifted, sign);
            let value = self.code.ins().bxor(value, bit);
            let value = self.seen_as(types::F64X2, value);
            self.narrow(value)
        };
        [signed(turned[0], k), signed(turned[1], next)]
    }

    /// Mask of both lanes with these bits, for trigonometry.
    fn mask(&mut self, bits: u64) -> Value {
        let lane = bits.to_le_bytes();
        let both: Vec<u8> = lane.into_iter().chain(lane).collect();
        let constant = self.code.func.dfg.constants.insert(both.into());
        self.code.ins().vconst(types::I64X2, constant)
    }
}
