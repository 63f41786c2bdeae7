//! Divided differences of the exponential function.
//!
//! What has the Laplace transform `1 / ((s - z_1) ... (s - z_n))` is `E[z_1, ..., z_n]` at the time 1: so
//! responses to exponentials and powers of the time are divided differences, and so are integrals of their
//! products, for any nearby poles (McCurdy, Ng, Parlett: Accurate computation of divided
//! differences of the exponential function, Mathematics of Computation 43, 1984).

use super::{complex, Complex};
use crate::rounding::UNIT;

const ZERO: Complex = complex(0.0, 0.0);
/// Nodes at most.
pub const NODES: usize = 5;
/// Nodes nearer to their mean than this are summed by Taylor's series, of 18 terms at most.
const NEAR: f64 = 1.0;

/// `E[z0, ..., zm]`, at most [`NODES`] of them.
pub fn divided(z: &[Complex]) -> Complex {
    match *z {
        [] => complex(0.0, 0.0),
        [a] => a.exp(),
        [a, b] => pair(a, b),
        _ => several(z),
    }
}

/// `E[a, b]`, from the one that grows faster: the exponential of the difference does not overflow.
#[inline]
pub fn pair(a: Complex, b: Complex) -> Complex {
    let (slow, fast) = if a.re > b.re { (b, a) } else { (a, b) };
    let apart = slow - fast;
    let ratio = if apart == ZERO { complex(1.0, 0.0) } else { apart.exp_m1() / apart };
    if fast == ZERO {
        ratio
    } else {
        fast.exp() * ratio
    }
}

fn several(z: &[Complex]) -> Complex {
    let count = z.len();
    let mean = z.iter().fold(complex(0.0, 0.0), |s, &v| s + v).scale(1.0 / count as f64);
    if z.iter().all(|&v| (v - mean).abs() <= NEAR) {
        return mean.exp() * series(z, mean);
    }
    let (mut far, mut most) = ((0, 1), -1.0);
    for i in 0..count {
        for j in 0..i {
            let apart = (z[i] - z[j]).abs();
            if apart > most {
                (far, most) = ((j, i), apart);
            }
        }
    }
    let without = |left_out: usize| {
        let mut rest = [complex(0.0, 0.0); NODES];
        let kept = (0..count).filter(|&k| k != left_out);
        kept.enumerate().for_each(|(to, k)| rest[to] = z[k]);
        divided(&rest[..count - 1])
    };
    (without(far.0) - without(far.1)) / (z[far.1] - z[far.0])
}

/// `sum over j of h_j(z - mean) / (j + m)!` with the complete homogeneous polynomials `h_j`: of the first term
/// each is at most the part `far^j / j!`, no distance from the mean being above `far`.
fn series(z: &[Complex], mean: Complex) -> Complex {
    let far = z.iter().map(|&v| (v - mean).abs()).fold(0.0, f64::max);
    let mut products = [complex(1.0, 0.0); NODES];
    let mut factor = (1..z.len()).fold(1.0, |f, k| f / k as f64);
    let (mut sum, mut part) = (complex(factor, 0.0), 1.0);
    for j in 1.. {
        part *= far / f64::from(j);
        if part < UNIT {
            break;
        }
        factor /= f64::from(j) + (z.len() - 1) as f64;
        let mut all = ZERO;
        for (product, &node) in products.iter_mut().zip(z) {
            *product = all + (node - mean) * *product;
            all = *product;
        }
        sum = sum + all.scale(factor);
    }
    sum
}
