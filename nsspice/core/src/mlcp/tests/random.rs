//! Random problems with a planted solution or an answer by enumeration.

use crate::mlcp::{work_len, Driver, Problem, Role, Start};
use crate::sparse::Csc;

/// xorshift64*: reproducible and good enough for test data.
struct Rng(u64);

impl Rng {
    fn new(seed: u64) -> Rng {
        Rng(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// uniform in (-1, 1)
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n
    }

    fn chance(&mut self, p: f64) -> bool {
        self.signed() * 0.5 + 0.5 < p
    }
}

struct Instance {
    problem: Problem,
    rhs: Vec<f64>,
    q: Vec<f64>,
    roles: Vec<Role>,
}

fn csc(rows: usize, cols: usize, entry: impl Fn(usize, usize) -> f64) -> Csc {
    let all = (0..rows).flat_map(|r| (0..cols).map(move |c| (r, c)));
    let entries: Vec<_> = all.map(|(r, c)| (r, c, entry(r, c))).filter(|e| e.2 != 0.0).collect();
    Csc::from_triplets(rows, cols, &entries)
}

fn product(m: &Csc, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; m.nrows];
    m.mul_add(1.0, x, &mut y);
    y
}

/// K = X X' + skew with X of any rank, D diagonal or zero, B = A'; rows scaled by powers of ten as
/// in circuits with values of all sizes; data such that a random complementary point solves it.
fn planted(seed: u64) -> Instance {
    let mut rng = Rng::new(seed);
    let (n, m) = (1 + rng.below(10), 1 + rng.below(12));
    let rank = rng.below(n + 1);
    let integer = rng.chance(0.5);
    let draw = |rng: &mut Rng| {
        if integer {
            rng.below(3) as f64 - 1.0
        } else if rng.chance(0.6) {
            rng.signed()
        } else {
            0.0
        }
    };
    let x: Vec<f64> = (0..n * rank.max(1)).map(|_| draw(&mut rng)).collect();
    let skew: Vec<f64> = (0..n * n).map(|_| draw(&mut rng)).collect();
    let a: Vec<f64> = (0..n * m).map(|_| draw(&mut rng)).collect();
    let spread = if rng.chance(0.3) { 4.0 } else { 0.0 };
    let scale: Vec<f64> = (0..n + m).map(|_| 10f64.powf(spread * rng.signed())).collect();
    let d: Vec<f64> =
        (0..m).map(|_| if rng.chance(0.2) { rng.signed().abs() } else { 0.0 }).collect();
    let k = csc(n, n, |r, c| {
        let gram: f64 = (0..rank).map(|j| x[r * rank + j] * x[c * rank + j]).sum();
        (gram + skew[r * n + c] - skew[c * n + r]) * scale[r] * scale[c]
    });
    let a = csc(n, m, |r, c| a[r * m + c] * scale[r] * scale[n + c]);
    let b = a.transpose();
    let d = csc(m, m, |r, c| if r == c { d[r] * scale[n + r] * scale[n + r] } else { 0.0 });
    let roles: Vec<Role> = (0..m)
        .map(|_| match rng.below(8) {
            0 => Role::Closed,
            1 => Role::Open,
            _ => Role::Diode,
        })
        .collect();
    let z: Vec<f64> = (0..n).map(|i| draw(&mut rng) / scale[i]).collect();
    let (mut l, mut w) = (vec![0.0; m], vec![0.0; m]);
    for i in 0..m {
        let value = if integer { rng.below(3) as f64 } else { rng.signed() };
        let on = rng.chance(0.5);
        match roles[i] {
            Role::Closed => l[i] = value / scale[n + i],
            Role::Open => w[i] = value * scale[n + i],
            Role::Diode if on => l[i] = value.abs() / scale[n + i],
            Role::Diode => w[i] = value.abs() * scale[n + i],
        }
    }
    let mut rhs = product(&k, &z);
    a.mul_add(1.0, &l, &mut rhs);
    let mut q = w;
    b.mul_add(1.0, &z, &mut q);
    d.mul_add(-1.0, &l, &mut q);
    Instance { problem: Problem { k, a, b, d, row_kind: vec![0; n] }, rhs, q, roles }
}

#[test]
fn planted_monotone_problems_are_solved() {
    let mut stages = [0u32; 6];
    let mut roundabout = 0;
    for seed in 1..=3000 {
        let p = planted(seed);
        let (n, m) = (p.rhs.len(), p.q.len());
        let mut driver = Driver::new(p.problem);
        let (mut z, mut l) = (vec![0.0; n], vec![0.0; m]);
        let solved = driver.solve(&p.rhs, &p.q, &p.roles, &mut z, &mut l, Start::Cold);
        let solved = solved.unwrap_or_else(|u| panic!("seed {seed}: {:?}", u.residual));
        stages[usize::from(solved.stage)] += 1;
        let again = driver.residual(&p.rhs, &p.q, &p.roles, &z, &l);
        assert!(again.worst() <= 1e-10, "seed {seed}: {again:?}");
        // a second solve from the solution must stay there
        let before = (z.clone(), l.clone());
        let solved = driver.solve(&p.rhs, &p.q, &p.roles, &mut z, &mut l, Start::Warm).unwrap();
        // where rounding of the first stage is a flaw relative to the pairs, the second one polishes
        roundabout += u32::from(solved.stage != 1);
        assert!(solved.stage <= 2, "seed {seed}");
        let size = before.0.iter().chain(&before.1).fold(0.0f64, |a, v| a.max(v.abs()));
        for (x, y) in z.iter().chain(&l).zip(before.0.iter().chain(&before.1)) {
            assert!((x - y).abs() <= 1e-6 * size, "seed {seed} moved from {y} to {x}");
        }
    }
    assert!(stages[1] > 2000, "{stages:?}");
    assert!(roundabout <= 3, "{roundabout}");
}

#[test]
fn sequences_from_the_previous_solution_are_solved() {
    for seed in 1..=300 {
        let first = planted(seed);
        let (n, m) = (first.rhs.len(), first.q.len());
        let mut driver = Driver::new(first.problem.clone());
        let (mut z, mut l) = (vec![0.0; n], vec![0.0; m]);
        for k in 0..10 {
            // between two solvable problems with equal matrices lie solvable ones only
            let t = 1.0 - 0.2 * f64::from(k % 6);
            let rhs: Vec<f64> = first.rhs.iter().map(|v| v * t).collect();
            let q: Vec<f64> = first.q.iter().map(|v| v * t.abs()).collect();
            let q = if t < 0.0 { first.q.clone() } else { q };
            let rhs = if t < 0.0 { first.rhs.clone() } else { rhs };
            let solved = driver.solve(&rhs, &q, &first.roles, &mut z, &mut l, Start::Warm);
            assert!(solved.is_ok(), "seed {seed} step {k}");
        }
    }
}

/// The active pairs of a mode by its bits, and the multipliers and slacks that solve its equations.
fn in_mode(driver: &mut Driver, d: &Csc, q: &[f64], mode: u32) -> (Vec<bool>, Vec<f64>, Vec<f64>) {
    let active: Vec<bool> = (0..q.len()).map(|i| mode >> i & 1 == 1).collect();
    let mut x: Vec<f64> = q.iter().zip(&active).map(|(q, &on)| if on { -q } else { 0.0 }).collect();
    let mut work = vec![0.0; work_len(x.len())];
    driver.mode_factor(&active).solve(&mut x, &mut work);
    let mut w = q.to_vec();
    d.mul_add(1.0, &x, &mut w);
    (active, x, w)
}

#[test]
fn positive_definite_problems_agree_with_enumeration() {
    for seed in 1..=400 {
        let mut rng = Rng::new(77_000 + seed);
        let m = 1 + rng.below(7);
        let x: Vec<f64> = (0..m * m).map(|_| rng.signed()).collect();
        let y: Vec<f64> = (0..m * m).map(|_| rng.signed()).collect();
        let entry = |r: usize, c: usize| {
            let gram: f64 = (0..m).map(|k| x[r * m + k] * x[c * m + k]).sum();
            gram + y[r * m + c] - y[c * m + r] + if r == c { 0.1 } else { 0.0 }
        };
        let q: Vec<f64> = (0..m).map(|_| rng.signed()).collect();
        let d = csc(m, m, entry);
        let empty = Problem {
            k: Csc::zeros(0, 0),
            a: Csc::zeros(0, m),
            b: Csc::zeros(m, 0),
            d: d.clone(),
            row_kind: vec![],
        };
        let mut driver = Driver::new(empty);
        let roles = vec![Role::Diode; m];
        let mut l = vec![0.0; m];
        driver.solve(&[], &q, &roles, &mut [], &mut l, Start::Cold).unwrap();
        // of a P-matrix exactly one mode (but for equal ones) solves the problem
        let best = (0u32..1 << m)
            .filter_map(|mode| {
                let (_, x, w) = in_mode(&mut driver, &d, &q, mode);
                let good = (0..m).all(|i| x[i] >= -1e-9 && w[i] >= -1e-9);
                good.then_some(x)
            })
            .next()
            .expect("a P-matrix has a solution for every q");
        for (found, wanted) in l.iter().zip(&best) {
            assert!((found - wanted).abs() <= 1e-8, "seed {seed}: {found} instead of {wanted}");
        }
    }
}

#[test]
fn problems_without_monotonicity_are_solved_where_enumeration_finds_a_solution() {
    let (mut solvable, mut solved) = (0, 0);
    for seed in 1..=300 {
        let mut rng = Rng::new(99_000 + seed);
        let m = 1 + rng.below(6);
        let values: Vec<f64> = (0..m * m).map(|_| rng.signed()).collect();
        let q: Vec<f64> = (0..m).map(|_| rng.signed()).collect();
        let d = csc(m, m, |r, c| values[r * m + c]);
        let mut driver = Driver::new(Problem {
            k: Csc::zeros(0, 0),
            a: Csc::zeros(0, m),
            b: Csc::zeros(m, 0),
            d: d.clone(),
            row_kind: vec![],
        });
        let exists = (0u32..1 << m).any(|mode| {
            let (active, x, w) = in_mode(&mut driver, &d, &q, mode);
            (0..m).all(|i| if active[i] { x[i] >= 0.0 } else { w[i] >= 0.0 })
        });
        let roles = vec![Role::Diode; m];
        let mut l = vec![0.0; m];
        let found = driver.solve(&[], &q, &roles, &mut [], &mut l, Start::Cold).is_ok();
        solvable += u32::from(exists);
        solved += u32::from(found && exists);
        assert!(!found || exists, "seed {seed}: a solution that enumeration does not know");
    }
    assert!(solvable > 150);
    assert_eq!(solved, solvable);
}
