//! Where a run is: its plan, the segment, the motion along it and the state.

use crate::modewise::functions::inputs::Segment;
use crate::modewise::functions::terms::Point;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::network::Network;
use crate::modewise::modes::registry::Id;
use crate::modewise::segments::root_bracketing::Ending;
use crate::modewise::segments::trajectory::Trajectory;
use crate::row_clock::RowClock;
use std::sync::Arc;

/// What has been asked for.
pub(super) struct Plan {
    pub rows: RowClock,
    pub stop: f64,
    /// longest implicit step where the exact engine is at a loss
    pub fixed_step: f64,
}

/// What the engine is doing.
pub(super) enum Phase {
    /// nothing yet
    Fresh,
    /// inside a segment that is known up to its end
    Moving,
    /// implicit steps of this length
    Stepping(f64),
}

/// The times of the present segment, and how it ends.
pub(super) struct Span {
    pub phase: Phase,
    /// its start [s]
    pub time: f64,
    /// its end [s]
    pub end: f64,
    pub ending: Ending,
    pub breakpoint: f64,
    pub crossing: Vec<usize>,
}

impl Default for Span {
    fn default() -> Span {
        Span {
            phase: Phase::Fresh,
            time: 0.0,
            end: 0.0,
            ending: Ending::Horizon,
            breakpoint: f64::NEG_INFINITY,
            crossing: Vec::new(),
        }
    }
}

/// The motion along the segment.
#[derive(Default)]
pub(super) struct Motion {
    pub present: Option<(Id, Arc<Mode>)>,
    pub path: Trajectory,
    pub segment: Segment,
    /// the end of the segment
    pub point: Point,
}

/// Energy coordinates at the start of the segment, the modal state at its end, and the unknowns of implicit steps.
pub(super) struct State {
    pub a: Vec<f64>,
    pub x: Vec<f64>,
    pub spare: Vec<f64>,
    pub z: Vec<f64>,
    pub l: Vec<f64>,
    pub v: Vec<f64>,
}

impl State {
    /// Nothing is stored; `count` inputs, the constant included.
    pub fn new(net: &Network, count: usize) -> State {
        State {
            a: vec![0.0; net.states],
            x: Vec::new(),
            spare: Vec::new(),
            z: vec![0.0; net.n],
            l: vec![0.0; net.m],
            v: vec![0.0; count],
        }
    }
}
