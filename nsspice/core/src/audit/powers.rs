//! Energies and powers as forms of the unknowns.

use super::form::Form;
use super::matrix::Entries;
use super::rounding::{share, Reach};
use super::{Between, ITERATED, TOLERANCE};
use crate::dense::dot;
use crate::descriptor::{Linear, Smooth};
use crate::sparse::Csc;

/// An energy, or power, that the largest voltage and current bring about: a form of both.
type Product = [[f64; 2]; 2];

fn product(form: &Product, largest: &[f64; 2]) -> f64 {
    (0..2).map(|kind| largest[kind] * dot(&form[kind], largest)).sum()
}

/// A sparse matrix between two lists of numbers.
#[derive(Clone, Debug)]
pub(super) struct Bilinear {
    pub columns: Csc,
    pub entries: Entries,
}

impl Bilinear {
    fn new(matrix: &Csc) -> Bilinear {
        Bilinear { columns: matrix.clone(), entries: Entries::new(matrix) }
    }

    /// `y' M x`
    #[inline]
    pub fn between(&self, y: &[f64], x: impl Fn(usize) -> f64) -> f64 {
        let mut sum = 0.0;
        for &(row, column, value) in self.entries.list() {
            sum += value * y[row as usize] * x(column as usize);
        }
        sum
    }
}

/// What is stored and dissipated at a point, and what rounding may make of both.
#[derive(Clone, Debug)]
pub(super) struct Powers {
    pub stored: Form,
    /// rates that control sources
    pub controls: Bilinear,
    pub resisted: Form,
    /// `E` and `G` row by row
    pub laws: [Csc; 2],
    /// charge or flux in each law while its own unknown stores half a joule
    pub joule: Vec<f64>,
    pub a: Bilinear,
    pub s: Bilinear,
    pub averaging: Option<(Bilinear, Bilinear)>,
    /// where smooth functions act, and where they are stored
    pub smooth: Option<(Bilinear, Bilinear)>,
    pub kinds: Vec<u8>,
    pub reach: Reach,
    share: f64,
    /// what the largest voltage and current store, and what they do
    content: Product,
    acting: Product,
}

impl Powers {
    /// Of the arrays of a system in which something is stored.
    pub fn new(
        linear: &Linear,
        Between { capacitors, conductors, coordinates }: Between,
        averaging: Option<&(Csc, Csc)>,
        smooth: Option<&Smooth>,
    ) -> Powers {
        let (e, g, a) = (&linear.e, &linear.g, &linear.a);
        let [storage, controls] = linear.storage_and_controls();
        let [entries_e, entries_g, entries_a] = [e, g, a].map(Entries::new);
        let h = averaging.map(|(h, _)| Entries::new(h));
        let kinds = linear.row_kind.clone();
        let size = g.nrows + a.ncols;
        let average = h.as_ref();
        let reach = Reach::new(&kinds, a.ncols, &entries_e, &entries_g, &entries_a, average);
        let mut joule = vec![0.0; g.nrows];
        e.iter()
            .filter(|(row, col, _)| row == col)
            .for_each(|(row, _, v)| joule[row] = v.abs().sqrt());
        let known = if smooth.is_some() { ITERATED / TOLERANCE } else { 0.0 };
        let [mut content, mut acting] = [Product::default(); 2];
        for (row, &kind) in kinds.iter().enumerate() {
            for (k, unit) in [[1.0, 0.0], [0.0, 1.0]].iter().enumerate() {
                content[usize::from(kind)][k] += reach.content(row, unit);
                acting[usize::from(kind)][k] += reach.acting(row, unit);
            }
        }
        Powers {
            stored: Form::new(&storage, capacitors, coordinates),
            controls: Bilinear::new(&controls),
            resisted: Form::new(g, conductors, coordinates),
            laws: [e.clone(), g.clone()],
            joule,
            a: Bilinear::new(a),
            s: Bilinear::new(&linear.s),
            averaging: averaging.map(|(h, hs)| (Bilinear::new(h), Bilinear::new(hs))),
            smooth: smooth.map(|laws| (Bilinear::new(&laws.f), Bilinear::new(&laws.q))),
            kinds,
            reach,
            share: share(size).max(known),
            content,
            acting,
        }
    }

    pub fn energy(&self, z: &[f64]) -> f64 {
        0.5 * self.stored.at(|k| z[k])
    }

    /// Energy that laws may be off by in points and time, to the rounding of elimination (see
    /// [`super::rounding`]), or to that at which an iteration ends: of what they store once in each step
    /// (twice: at both its ends), of what acts in them all the time.
    pub fn rounding(&self, (points, time): (u64, f64), largest: &[f64; 2]) -> f64 {
        let stored = 2.0 * points as f64 * product(&self.content, largest);
        self.share * (stored + time * product(&self.acting, largest))
    }

    /// Power that is dissipated in resistors and set-valued elements.
    #[inline]
    pub fn lost(&self, z: &[f64], l: &[f64]) -> f64 {
        self.resisted.at(|k| z[k]) + self.a.between(z, |j| l[j])
    }

    /// The same beside the voltages and currents of a point, each where it is.
    #[cold]
    pub fn rounding_at(&self, (points, time): (u64, f64), [z, l, f]: [&[f64]; 3]) -> f64 {
        let size: Vec<f64> = z.iter().map(|v| v.abs()).collect();
        let [mut stored, mut acting] = [0; 2].map(|_| vec![0.0; z.len()]);
        self.laws[0].abs_mul_add(&size, &mut stored);
        self.laws[1].abs_mul_add(&size, &mut acting);
        self.a.columns.abs_mul_add(l, &mut acting);
        if let Some((flowing, kept)) = &self.smooth {
            flowing.columns.abs_mul_add(f, &mut acting);
            kept.columns.abs_mul_add(f, &mut stored);
        }
        self.share * (2.0 * points as f64 * dot(&size, &stored) + time * dot(&size, &acting))
    }
}
