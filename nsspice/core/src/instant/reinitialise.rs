//! The problems of an instant one after the other, see the module.

use super::active_set::OneWay;
use crate::dense::{Echelon, Matrix};
use crate::descriptor::Linear;
use crate::mlcp::Role;
use crate::sparse::Csc;
use crate::structure::{Branch, Coordinates, Coupled, Elements, Law, SUMS};

/// Networks with more branches are left to sparse methods: the loops of one forest grow with their square.
const MOST: usize = 2000;

/// What is known from before.
#[derive(Clone, Copy)]
pub enum Before<'a> {
    /// charges and fluxes, one for each equation
    Stored(&'a [f64]),
    /// unknowns
    State(&'a [f64]),
}

/// The state right after an instant.
pub struct Consistent {
    /// unknowns
    pub z: Vec<f64>,
    /// rates of those that store something
    pub rates: Vec<f64>,
    /// multipliers
    pub l: Vec<f64>,
    /// pairs that conduct from here on
    pub active: Vec<bool>,
    /// pairs that conduct in the jump
    pub through: Vec<bool>,
    /// impulses of the unknowns and of the multipliers [A s or V s]
    pub impulses: [Vec<f64>; 2],
}

/// Finds the states right after instants of one network.
pub struct Reinitialiser {
    elements: Elements,
    sources: Csc,
    offsets: Vec<f64>,
    size: usize,
    pairs: usize,
}

impl Reinitialiser {
    /// Prepares a network; nothing if it holds elements that are not known here.
    pub fn new(
        linear: &Linear,
        capacitors: &[(isize, isize, f64)],
        resistors: &[(isize, isize, f64)],
        coordinates: &Coordinates,
    ) -> Option<Reinitialiser> {
        let elements = Elements::read(linear, capacitors, resistors, coordinates)?;
        let branches = [
            &elements.capacitors,
            &elements.resistors,
            &elements.voltages,
            &elements.pairs,
            &elements.inductors,
        ];
        let coupled: usize = elements.groups.iter().map(|g| g.windings.len()).sum();
        let all: usize = branches.iter().map(|list| list.len()).sum::<usize>() + coupled;
        if all > MOST {
            return None;
        }
        Some(Reinitialiser {
            elements,
            sources: linear.s.clone(),
            offsets: linear.q.clone(),
            size: linear.g.nrows,
            pairs: linear.a.ncols,
        })
    }

    /// Whether inductors are coupled.
    pub fn is_coupled(&self) -> bool {
        !self.elements.groups.is_empty()
    }

    /// Whether sources, capacitors and closed switches (`closed`, by pair) form a loop through perfectly coupled
    /// inductors: what these then fix twice may jump.  In such a loop a winding's law depends on the others.
    pub fn loops_through_windings(&self, closed: &[bool]) -> bool {
        let elements = &self.elements;
        let tight: Vec<&Coupled> = elements.groups.iter().filter(|g| !g.leaks()).collect();
        let shut = |b: &&Branch| b.value == 0.0 && b.index.is_some_and(|pair| closed[pair]);
        let fixed = elements.voltages.iter().chain(&elements.capacitors);
        let fixed: Vec<&Branch> = fixed.chain(elements.pairs.iter().filter(shut)).collect();
        let wound: Vec<(&Coupled, usize)> =
            tight.iter().flat_map(|g| (0..g.windings.len()).map(move |k| (*g, k))).collect();
        let rank = |rows: usize| {
            let mut law = Matrix::zeros(rows, elements.nodes);
            let ends = fixed.iter().map(|b| b.ends);
            let ends = ends.chain(wound.iter().map(|(g, k)| g.windings[*k].ends));
            for (row, [plus, minus]) in ends.take(rows).enumerate() {
                law[(row, plus)] += 1.0;
                law[(row, minus)] -= 1.0;
            }
            for (row, (group, k)) in wound.iter().enumerate().take(rows - fixed.len()) {
                let largest = (0..group.windings.len()).map(|k| group.turns(k, 0).abs());
                let largest = largest.fold(f64::MIN_POSITIVE, f64::max);
                for core in 0..group.cores() {
                    law[(fixed.len() + row, group.first + core)] -= group.turns(*k, core) / largest;
                }
            }
            // potentials are counted against ground, the last node
            Echelon::new(law, 0..elements.nodes - 1).pivots.len()
        };
        rank(fixed.len() + wound.len()) < rank(fixed.len()) + wound.len()
    }

    /// The state right after an instant, with the sources `u`, their slopes and the roles of all pairs; nothing if
    /// it was not found.  Currents are known to the rounding of the `largest` so far.
    pub fn after(
        &self,
        before: Before,
        [u, slopes]: [&[f64]; 2],
        roles: &[Role],
        largest: f64,
    ) -> Option<Consistent> {
        let mut instant = Instant::new(self, before, [u, slopes], roles);
        instant.nothing = SUMS * largest;
        instant.solve(before)
    }
}

/// One instant.
pub(super) struct Instant<'a> {
    r: &'a Reinitialiser,
    roles: &'a [Role],
    /// what sources bring into each equation, and its rate
    pub driven: Vec<f64>,
    pub rising: Vec<f64>,
    /// potentials before, those of parts that nothing joins to ground stay
    pub potentials: Vec<f64>,
    /// currents below this are rounding
    pub nothing: f64,
    /// fluxes of the cores of each group
    pub fluxes: Vec<Vec<f64>>,
}

impl<'a> Instant<'a> {
    fn new(
        r: &'a Reinitialiser,
        before: Before,
        [u, slopes]: [&[f64]; 2],
        roles: &'a [Role],
    ) -> Instant<'a> {
        let right = |u: &[f64]| {
            let mut out = vec![0.0; r.size];
            r.sources.mul_add(1.0, u, &mut out);
            out
        };
        let potentials = match before {
            Before::Stored(_) => vec![0.0; r.elements.nodes],
            Before::State(z) => r.elements.potentials(z),
        };
        let fluxes = r.elements.groups.iter().map(|group| {
            let row = |k: usize| group.windings[k].index.unwrap_or(0);
            match before {
                Before::Stored(linked) => group.fluxes_of(|k| linked[row(k)]),
                Before::State(z) => group.fluxes(|k| z[row(k)]),
            }
        });
        let fluxes = fluxes.collect();
        let (driven, rising) = (right(u), right(slopes));
        Instant { r, roles, driven, rising, potentials, nothing: 0.0, fluxes }
    }

    pub fn elements(&self) -> &'a Elements {
        &self.r.elements
    }

    fn role(&self, pair: &Branch) -> Role {
        pair.index.map_or(Role::Open, |k| self.roles[k])
    }

    pub fn offset(&self, pair: &Branch) -> f64 {
        pair.index.map_or(0.0, |k| self.r.offsets[k])
    }

    /// The voltage of a source.
    pub fn source(&self, list: &[f64], branch: &Branch) -> f64 {
        -branch.index.map_or(0.0, |row| list[row])
    }

    /// Pairs in a role.
    pub fn pairs(&self, role: Role) -> Vec<Branch> {
        let pairs = self.elements().pairs.iter();
        pairs.filter(|pair| self.role(pair) == role).copied().collect()
    }

    /// Those of them without resistance.
    pub fn ideal(&self, role: Role) -> Vec<Branch> {
        let mut pairs = self.pairs(role);
        pairs.retain(|pair| pair.value == 0.0);
        pairs
    }

    /// A closed switch.
    pub fn closed_law(&self, branch: &Branch) -> Law {
        let offset = self.offset(branch);
        if branch.value > 0.0 {
            Law::Weighted { weight: 1.0 / branch.value, offset }
        } else {
            Law::Fixed(offset)
        }
    }

    pub fn way(&self, pair: &Branch) -> OneWay {
        OneWay { ends: pair.ends, offset: self.offset(pair), series: pair.value }
    }

    /// The groups of coupled inductors whose currents are not determined by their fluxes.
    pub fn tight(&self) -> impl Iterator<Item = (&'a Coupled, &[f64])> + '_ {
        let all = self.elements().groups.iter().zip(&self.fluxes);
        all.filter(|(group, _)| !group.leaks()).map(|(group, fluxes)| (group, &fluxes[..]))
    }

    fn solve(&mut self, before: Before) -> Option<Consistent> {
        let mut out = Consistent {
            z: vec![0.0; self.r.size],
            rates: vec![0.0; self.r.size],
            l: vec![0.0; self.r.pairs],
            active: self.roles.iter().map(|&r| r == Role::Closed).collect(),
            through: vec![false; self.r.pairs],
            impulses: [vec![0.0; self.r.size], vec![0.0; self.r.pairs]],
        };
        let charged = self.charges(before, &mut out)?;
        let blocked = self.jump_of_fluxes(before, &mut out)?;
        let values = self.values(&charged, &mut out)?;
        self.rates(&values, &mut out)?;
        self.share(&values, &mut out);
        for (through, &active) in out.through.iter_mut().zip(&out.active) {
            *through |= active;
        }
        blocked.into_iter().for_each(|pair| out.through[pair] = false);
        Some(out)
    }
}
