//! What a run consists of besides its state: plain records of what belongs together.

use super::clock::Target;
use super::controls::Controls;
use super::failure::Failure;
use super::impacts::Impacts;
use super::jumps::Jump;
use super::record::Outputs;
use super::stage::Stage;
use super::stepper::{Large, Plan};
use super::storage::Storage;
use super::witness::Witness;
use crate::audit::Sums;
use crate::instant::{Continuous, Reinitialiser};
use crate::resting::Resting;
use crate::structure::Coordinates;
use crate::switch::Switch;
use std::sync::Arc;

/// The switches and what decides about them.
pub struct Switching {
    /// all of them
    pub(super) switches: Arc<[Switch]>,
    /// those that chatter, see [`crate::sampling`]
    pub(super) sampled: Vec<bool>,
    /// how far the control of each has been from its threshold
    pub(super) swings: Vec<f64>,
    /// those that rest at thresholds
    pub(super) resting: Resting,
    /// whether a control that is at its threshold is taken to stay there
    pub(super) still: Vec<bool>,
    /// the points of a sweep: each is at rest, and no time passes between them
    pub(super) frozen: bool,
    /// state of each switch's gate
    pub(super) gates: Vec<bool>,
    /// pairs that open and close by themselves
    pub(super) diodes: Vec<usize>,
    /// switches that sources decide about
    pub(super) controls: Controls,
    /// the switch that has changed last
    pub(super) last_thrown: Option<usize>,
}

/// What is known of the network once and for all.
pub struct Facts {
    /// of each source its value, if that is constant
    pub(super) constants: Vec<Option<f64>>,
    /// nothing is stored
    pub(super) static_system: bool,
    /// of each source, whether something may jump where its slope does
    pub(super) kinks: Vec<bool>,
    /// unknowns that constant and piecewise linear sources alone determine: no step errs in them
    pub(super) fixed: Vec<bool>,
    /// which voltages the unknowns are, if not all are counted against ground
    pub(super) coordinates: Option<Coordinates>,
    /// then: the capacitances that meet in each node [F]
    pub(super) node_storage: Vec<f64>,
    /// the least and the largest conductance of a resistor [S]
    pub(super) conductances: [f64; 2],
    /// fastest time constant [s]
    pub(super) fastest: f64,
    /// groups of laws in whose sum nothing is stored, not by smooth functions either; most are one law
    pub(super) at_once: Vec<Vec<usize>>,
    /// stores, and what determines them
    pub(super) storage: Storage,
}

/// What finds states right after instants at which something may jump, and what jumps are measured by.
pub struct Instants {
    /// jumps by the structure of the network, where it is known
    pub(super) reinitialiser: Option<Box<Reinitialiser>>,
    /// the state after instants at which nothing jumps
    pub(super) continuous: Option<Box<Continuous>>,
    /// the largest current so far, where that is looked after [A]
    pub(super) felt: f64,
    /// rates of what is stored at the present state, where a jump in closed form has just told them
    pub(super) begun: Option<Vec<f64>>,
    /// scratch: slopes of the sources
    pub(super) slopes: Vec<f64>,
    /// what charges and fluxes are measured by in jumps, and the largest so far of each kind
    pub(super) weights: Vec<f64>,
    /// the largest so far of each kind, by the weights
    pub(super) heaviest: [f64; 2],
    /// largest charge and flux at a possible jump so far
    pub(super) largest: [f64; 2],
    /// scratch: charges and fluxes on both sides of what may be a jump, and what they are measured by
    pub(super) moving: [Vec<f64>; 5],
    /// pairs that close at speed
    pub(super) impacts: Impacts,
    /// the unknowns are those before the sources or switches that changed last: no jump has been found
    pub(super) stale: bool,
}

/// What is shown and kept of a run.
pub struct Recorder {
    /// what rows are made of
    pub(super) outputs: Outputs,
    /// rates of the unknowns, where outputs need them
    pub(super) rates: Vec<f64>,
    /// what is left for the certificate
    pub witness: Witness,
    /// what goes with the run for the certificate: its balance of energy
    pub sums: Option<Box<Sums>>,
    /// the last step ended in a jump; `left` is the row before it
    pub(super) two_sided: bool,
    /// the row before a jump
    pub(super) left: Vec<f64>,
    /// unknowns at the begin of the recorded step
    pub(super) z_recorded: Vec<f64>,
    /// from here on every step is a row, and a jump two [s]; infinite for rows of the grid only
    pub(super) all_points: f64,
    /// the row at the begin is still to come
    pub(super) first_row: bool,
    /// changes of pairs: time, pair, whether it conducts from then on
    pub events: Vec<(f64, usize, bool)>,
    /// recorded jumps
    pub jumps: Vec<Jump>,
    /// the state of the pairs that `events` leads to
    pub(super) logged: Vec<bool>,
    /// the epoch of `logged`
    pub(super) logged_epoch: u64,
}

/// Work space, and what the last attempt of a step has left there.
pub struct Scratch {
    /// a trial: unknowns and guards
    pub(super) x: Vec<f64>,
    /// of the map of a mode
    pub(super) input: Vec<f64>,
    /// right-hand side
    pub(super) rhs: Vec<f64>,
    /// slacks
    pub(super) w: Vec<f64>,
    /// how negative a guard may be by rounding; for which mode and step length, up to which step
    pub(super) noise: Vec<f64>,
    /// for which mode and step length `noise` is known, up to which step
    pub(super) noise_known: (u64, f64, u64),
    /// the mode just tried is still new: its residuals are checked in every step
    pub(super) recent: bool,
    /// of solvers
    pub(super) work: Vec<f64>,
    /// unknowns before the step
    pub(super) z_before: Vec<f64>,
    /// multipliers before the step
    pub(super) l_before: Vec<f64>,
    /// time of the state where smooth functions were evaluated last [s]
    pub(super) smooth_time: f64,
}

/// Which instants come next.
pub struct Schedule {
    /// all of them
    pub(super) plan: Plan,
    /// a dynamic system at the points of a sweep: its static equations are solved
    pub(super) sweeping: bool,
    /// one to be tried again
    pub(super) retry: Option<Target>,
    /// nominal step [s]
    pub(super) step_length: f64,
}

/// Matrices by step length.
pub struct Levels {
    /// by step length
    pub(super) stages: Vec<Stage>,
    /// counts uses
    pub(super) stamp: u64,
    /// the stage used last
    pub(super) last_stage: usize,
}

/// What was not solved, and what the caller thinks of it.
pub struct Refusal {
    /// solutions so large that they are doubtful
    pub(super) large: Large,
    /// the last failure
    pub failure: Option<Failure>,
}
