//! A system prepared for all of its runs: its reduction, and the modes that are reduced from it.
//!
//! A mode may also be derived from another one, but its rounding errors then depend on that one.
//! Such modes are not kept, so that the results of a run do not depend on the runs before it.

use crate::instant::Reinitialiser;
use crate::modewise::functions::inputs::Inputs;
use crate::modewise::modes::implicit_step::Models;
use crate::modewise::modes::mode::Mode;
use crate::modewise::modes::network::{Assembly, Network};
use crate::switch::Switch;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Memory for modes kept from run to run [bytes]; later ones are reduced in each run that meets them.
const BUDGET: usize = 4 << 20;

/// Active pairs and switch states.
type Key = (Box<[bool]>, Box<[bool]>);

/// Modes that were reduced from the network.
#[derive(Default)]
pub struct Reduced {
    known: Mutex<(HashMap<Key, Arc<Mode>>, usize)>,
}

impl Reduced {
    /// A mode; the error says what is wrong with it.
    pub fn mode(
        &self,
        net: &Network,
        switches: &[Switch],
        on: &[bool],
        gates: &[bool],
    ) -> Result<Arc<Mode>, String> {
        let key = (on.into(), gates.into());
        if let Some(found) = self.known.lock().unwrap_or_else(PoisonError::into_inner).0.get(&key) {
            return Ok(found.clone());
        }
        let made = Arc::new(Mode::new(net, switches, on, gates)?);
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if known.1 + made.bytes() <= BUDGET {
            known.1 += made.bytes();
            known.0.insert(key, made.clone());
        }
        Ok(made)
    }
}

/// A system that can be solved mode by mode.
#[derive(Clone)]
pub struct Prepared {
    /// as assembled
    pub sys: Arc<Assembly>,
    /// its jumps by its structure, where that is known
    pub reinitialiser: Option<Arc<Reinitialiser>>,
    /// its reduction
    pub net: Arc<Network>,
    /// switches
    pub switches: Arc<[Switch]>,
    /// sources
    pub inputs: Inputs,
    /// modes
    pub modes: Arc<Reduced>,
    /// implicit steps
    pub models: Arc<Models>,
}

impl Prepared {
    /// Reduces a system; the error says why it cannot be treated mode by mode.
    pub fn new(sys: Assembly, inputs: Inputs, switches: Arc<[Switch]>) -> Result<Prepared, String> {
        let net = Arc::new(Network::new(&sys, &inputs)?);
        let known =
            Reinitialiser::new(&sys.linear, &sys.capacitors, &sys.conductors, &sys.coordinates);
        let reinitialiser = known.map(Arc::new);
        let (sys, modes, models) = (Arc::new(sys), Arc::default(), Arc::default());
        Ok(Prepared { sys, reinitialiser, net, switches, inputs, modes, models })
    }

    /// The same with waveforms added to slacks (rows from 0 on) and to the controls of switches, first to those below
    /// their thresholds, then to those above (rows after the pairs): row, waveform, factor.
    pub fn with_offsets(mut self, offsets: &[(usize, usize, f64)]) -> Result<Prepared, String> {
        if offsets.is_empty() {
            return Ok(self);
        }
        let mut net = Network::new(&self.sys, &self.inputs)?;
        for &(row, waveform, factor) in offsets {
            for (c, f) in self.inputs.combine(&[(waveform, factor)]).into_iter().enumerate() {
                if row < net.m {
                    net.q[(row, c)] += f;
                } else if f != 0.0 {
                    let (row, count) = (row - net.m, self.switches.len());
                    net.controls.push((row % count, row >= count, c, f));
                }
            }
        }
        (self.net, self.modes) = (Arc::new(net), Arc::default());
        Ok(self)
    }
}
