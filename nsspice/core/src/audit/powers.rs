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

/// What is stored and dissipated at a point, and what rounding may make of both.
#[derive(Clone, Debug)]
pub(super) struct Powers {
    pub stored: Form,
    /// rates that control sources
    pub controls: Entries,
    pub resisted: Form,
    /// `E` and `G` row by row
    pub laws: [Entries; 2],
    /// charge or flux in each law while its own unknown stores half a joule
    pub joule: Vec<f64>,
    pub a: Entries,
    pub s: Entries,
    pub averaging: Option<(Entries, Entries)>,
    /// where smooth functions act, and where they are stored
    pub smooth: Option<(Entries, Entries)>,
    pub kinds: Vec<u8>,
    pub pairs: usize,
    pub reach: Reach,
    /// the part of its terms that rounding may leave of a law, in units of the tolerance
    pub share: f64,
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
        let [entries_e, entries_g, a] = [e, g, a].map(Entries::new);
        let pairs = linear.a.ncols;
        let h = averaging.map(|(h, _)| Entries::new(h));
        let kinds = linear.row_kind.clone();
        let size = g.nrows + pairs;
        let average = h.as_ref();
        let mut reach = Reach::new(&kinds, pairs, &entries_e, &entries_g, &a, average);
        let slacks = [&linear.b, &linear.d].map(Entries::new);
        reach.know_pairs([&a, &slacks[0], &slacks[1]], &linear.q);
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
            controls: Entries::new(&controls),
            resisted: Form::new(g, conductors, coordinates),
            laws: [entries_e, entries_g],
            joule,
            a,
            s: Entries::new(&linear.s),
            averaging: averaging.map(|(h, hs)| (Entries::new(h), Entries::new(hs))),
            smooth: smooth.map(|laws| (Entries::new(&laws.f), Entries::new(&laws.q))),
            kinds,
            pairs,
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

    /// Power that is dissipated in resistors and set-valued elements, and acts in smooth functions and their rates.
    #[inline]
    pub fn lost(&self, z: &[f64], l: &[f64], [f, f_rate]: [&[f64]; 2]) -> f64 {
        let power = self.resisted.at(|k| z[k]) + self.a.between(z, |j| l[j]);
        let smooth = self.smooth.as_ref().map_or(0.0, |(acting, stored)| {
            acting.between(z, |k| f[k]) + stored.between(z, |k| f_rate[k])
        });
        power + smooth
    }

    /// The same relative to the voltages and currents of a point, each where it is.
    #[cold]
    pub fn rounding_at(&self, (points, time): (u64, f64), [z, l, f]: [&[f64]; 3]) -> f64 {
        let size: Vec<f64> = z.iter().map(|v| v.abs()).collect();
        let [mut stored, mut acting] = [0; 2].map(|_| vec![0.0; z.len()]);
        self.laws[0].add_sizes(1.0, z, &mut stored);
        self.laws[1].add_sizes(1.0, z, &mut acting);
        self.a.add_sizes(1.0, l, &mut acting);
        if let Some((flowing, kept)) = &self.smooth {
            flowing.add_sizes(1.0, f, &mut acting);
            kept.add_sizes(1.0, f, &mut stored);
        }
        self.share * (2.0 * points as f64 * dot(&size, &stored) + time * dot(&size, &acting))
    }
}
