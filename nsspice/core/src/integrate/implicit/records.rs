//! What a run consists of besides its state: plain records of what belongs together.

use super::events::impacts::Impacts;
use super::instants::storage::Storage;
use super::step_length::{ModeKey, Stage};
use super::stepper::Plan;
use super::time_grid::Target;
use crate::instant::{Continuous, DerivativeArray, Reinitialiser};
use crate::mlcp::work_len;
use crate::structure::Coordinates;
use std::collections::HashMap;

/// What is known of the network once and for all.
pub struct Facts {
    /// nothing is stored
    pub(in crate::integrate) static_system: bool,
    /// of each source, whether something may jump where its slope does
    pub(in crate::integrate) kinks: Vec<bool>,
    /// unknowns that constant and piecewise linear sources alone determine: no step errs in them
    pub(in crate::integrate) fixed: Vec<bool>,
    /// which voltages the unknowns are, if not all are counted against ground
    pub(in crate::integrate) coordinates: Option<Coordinates>,
    /// then: the capacitances that meet in each node [F]
    pub(in crate::integrate) node_storage: Vec<f64>,
    /// the least and the largest conductance of a resistor [S]
    pub(in crate::integrate) conductances: [f64; 2],
    /// fastest time constant [s]
    pub(in crate::integrate) fastest: f64,
    /// stores, and what determines them
    pub(in crate::integrate) storage: Storage,
}

/// What finds states right after instants at which something may jump, and what jumps are measured by.
pub struct Instants {
    /// jumps by the structure of the network, where it is known
    pub(in crate::integrate) reinitialiser: Option<Box<Reinitialiser>>,
    /// by the closed switches, whether they form loops through perfectly coupled inductors
    pub(in crate::integrate) looped: HashMap<ModeKey, bool>,
    /// the state after instants at which nothing jumps
    pub(in crate::integrate) continuous: Option<Box<Continuous>>,
    /// the same where functions or perfectly coupled inductors are there, or nothing else determines all
    pub(in crate::integrate) array: Option<Box<DerivativeArray>>,
    /// pairs count as being at zero below these guards: blocking, conducting
    pub(in crate::integrate) zero: Vec<[f64; 2]>,
    /// the largest current so far, where that is looked after [A]
    pub(in crate::integrate) felt: f64,
    /// rates of what is stored at the present state, where a closed form has just given them
    pub(in crate::integrate) begun: Option<Vec<f64>>,
    /// scratch: slopes of the sources
    pub(in crate::integrate) slopes: Vec<f64>,
    /// what charges and fluxes are measured by in jumps, and the largest so far of each kind
    pub(in crate::integrate) weights: Vec<f64>,
    /// the largest so far of each kind, by the weights
    pub(in crate::integrate) heaviest: [f64; 2],
    /// largest charge and flux at a possible jump so far
    pub(in crate::integrate) largest: [f64; 2],
    /// scratch: charges and fluxes on both sides of what may be a jump, and what they are measured by
    pub(in crate::integrate) moving: [Vec<f64>; 5],
    /// pairs that close at speed
    pub(in crate::integrate) impacts: Impacts,
    /// the unknowns are those before the sources or switches that changed last: no jump has been found
    pub(in crate::integrate) stale: bool,
}

impl Instants {
    /// For a network with `sources`, in which charges and fluxes are measured by weights.
    pub fn new(impacts: Impacts, weights: Vec<f64>, sources: usize) -> Instants {
        Instants {
            reinitialiser: None,
            looped: HashMap::new(),
            continuous: None,
            array: None,
            zero: Vec::new(),
            felt: 0.0,
            begun: None,
            slopes: vec![0.0; sources],
            weights,
            heaviest: [0.0; 2],
            largest: [0.0; 2],
            moving: Default::default(),
            impacts,
            stale: false,
        }
    }
}

/// Work space, and what the last attempt of a step has left there.
pub struct Scratch {
    /// a trial: unknowns and guards
    pub(in crate::integrate) x: Vec<f64>,
    /// of the map of a mode
    pub(in crate::integrate) input: Vec<f64>,
    /// right-hand side
    pub(in crate::integrate) rhs: Vec<f64>,
    /// slacks
    pub(in crate::integrate) w: Vec<f64>,
    /// how negative a guard may be by rounding; for which mode and step length, up to which step
    pub(in crate::integrate) noise: Vec<f64>,
    /// for which mode and step length `noise` is known, up to which step
    pub(in crate::integrate) noise_known: (u64, f64, u64),
    /// the mode just tried is still new: its residuals are checked in every step
    pub(in crate::integrate) recent: bool,
    /// of solvers
    pub(in crate::integrate) work: Vec<f64>,
    /// unknowns before the step
    pub(in crate::integrate) z_before: Vec<f64>,
    /// multipliers before the step
    pub(in crate::integrate) l_before: Vec<f64>,
    /// time of the state where smooth functions were evaluated last [s]
    pub(in crate::integrate) smooth_time: f64,
}

impl Scratch {
    /// For `n` unknowns and `m` pairs.
    pub fn new([n, m]: [usize; 2]) -> Scratch {
        Scratch {
            x: vec![0.0; n + m],
            input: Vec::new(),
            rhs: vec![0.0; n],
            w: vec![0.0; m],
            noise: vec![0.0; m],
            noise_known: (0, f64::NAN, 0),
            recent: true,
            work: vec![0.0; work_len(n + m)],
            z_before: vec![0.0; n],
            l_before: vec![0.0; m],
            smooth_time: 0.0,
        }
    }
}

/// Which instants come next.
pub struct Schedule {
    /// all of them
    pub(in crate::integrate) plan: Plan,
    /// a dynamic system at the points of a sweep: its static equations are solved
    pub(in crate::integrate) sweeping: bool,
    /// one to be tried again
    pub(in crate::integrate) retry: Option<Target>,
    /// nominal step [s]
    pub(in crate::integrate) step_length: f64,
}

/// Matrices by step length.
pub struct Levels {
    /// by step length
    pub(in crate::integrate) stages: Vec<Stage>,
    /// counts uses
    pub(in crate::integrate) stamp: u64,
    /// the stage used last
    pub(in crate::integrate) last_stage: usize,
}
