//! Jumps by the structure of the network, where it is known: no short steps, no lengths.

use super::jumps::{Jump, JUMP, MAX_JUMPS};
use crate::instant::{At, Before, Continuous, DerivativeArray, Moment, Reinitialiser};
use crate::integrate::implicit::step_length::mode_key;
use crate::integrate::implicit::stepper::Stepper;
use crate::integrate::implicit::time_grid::slopes;
use crate::integrate::implicit::time_grid::slopes_at;
use crate::mlcp::{Role, Start};
use crate::structure::Coordinates;

impl Stepper {
    /// Sets what the storage and conductance matrices have been summed from, as (unknown, unknown or -1, value).
    pub fn know_elements(
        &mut self,
        capacitors: &[(isize, isize, f64)],
        resistors: &[(isize, isize, f64)],
        coordinates: &Coordinates,
    ) {
        self.facts.coordinates = (!coordinates.are_potentials()).then(|| coordinates.clone());
        if let (Some(smooth), Some(tree)) = (&mut self.solver.smooth, &self.facts.coordinates) {
            smooth.know_tree(tree);
        }
        for &(a, b, c) in capacitors {
            for end in [a, b].into_iter().filter(|&end| end >= 0) {
                self.facts.node_storage[end as usize] += c;
            }
        }
        if self.solver.smooth.is_none() && !self.facts.static_system {
            let found =
                Reinitialiser::new(&self.solver.sys.linear, capacitors, resistors, coordinates);
            self.instants.reinitialiser = found.map(Box::new);
        }
        if !self.facts.static_system {
            let linear = &self.solver.sys.linear;
            let functions = self.solver.smooth.as_ref().map_or(0, |smooth| smooth.f.len());
            self.instants.array = DerivativeArray::new(linear, functions).map(Box::new);
            if self.solver.smooth.is_none() {
                self.instants.continuous = Continuous::new(linear).map(Box::new);
            }
        }
        self.instants.zero = vec![[0.0; 2]; self.state.l.len()];
    }

    /// Charges and fluxes jump so that all equations hold again; currents and voltages are those right after. False if
    /// the structure of the network is not known, or its equations were not solved: then nothing has changed.
    pub(in crate::integrate) fn reinitialise(&mut self, charges: Option<&[f64]>) -> bool {
        let Some(reinitialiser) = &self.instants.reinitialiser else { return false };
        let coupled = charges.is_none() && reinitialiser.is_coupled();
        if coupled {
            let closed: Vec<bool> =
                self.state.roles.iter().map(|&role| role == Role::Closed).collect();
            let looped = self.instants.looped.entry(mode_key(&closed));
            if !*looped.or_insert_with(|| reinitialiser.loops_through_windings(&closed)) {
                return false;
            }
        }
        let slopes = slopes_at(&self.waveforms, self.state.time);
        let before = charges.map_or(Before::State(&self.state.z), Before::Stored);
        let sources = [&self.state.u0[..], &slopes];
        let Some(found) =
            reinitialiser.after(before, sources, &self.state.roles, self.instants.felt)
        else {
            return false;
        };
        let (before, after) = (self.state.z.clone(), found.z);
        let jumps = self.jumps().noticed(charges, [&before, &after, &after], &[]);
        // after events of steps rates of perfectly coupled inductors are known to rounding of their fluxes alone
        if coupled && !jumps {
            return false;
        }
        self.take_values([&after, &found.l, &found.rates], &found.active);
        if jumps {
            self.solver.stats.jumps += 1;
            if self.recorder.jumps.len() < MAX_JUMPS {
                let [unknowns, multipliers] = found.impulses;
                self.recorder.jumps.push(Jump {
                    time: self.state.time,
                    before,
                    after,
                    multipliers,
                    unknowns,
                    functions: Vec::new(),
                    sources: self.state.u0.clone(),
                    length: 0.0,
                    span: 0.0,
                });
            }
        }
        self.instants.begun = (!coupled).then_some(found.rates);
        self.record_state(None);
        true
    }

    /// Takes unknowns, multipliers, rates and the mode right after an instant.
    fn take_values(&mut self, [z, l, rates]: [&[f64]; 3], active: &[bool]) {
        self.state.z.copy_from_slice(z);
        self.state.l.copy_from_slice(l);
        self.state.turn_to(active);
        if self.recorder.outputs.needs_rates() {
            self.recorder.rates.copy_from_slice(rates);
        }
    }

    /// Charges and fluxes stay as they are, the rest follows from them; false if they may jump, or the next mode is
    /// not found in this way: then nothing has changed.
    pub(in crate::integrate) fn goes_on(&mut self) -> bool {
        let Some(mut continuous) = self.instants.continuous.take() else { return false };
        slopes(&self.waveforms, self.state.time, &mut self.instants.slopes);
        let at = At {
            sources: [&self.state.u0, &self.instants.slopes],
            roles: &self.state.roles,
            active: &self.state.active,
            voltage: self.solver.sys.largest(&[&self.state.z])[0],
        };
        let found = continuous.find(&self.solver.sys.linear, [&self.state.z, &self.state.l], at);
        if found {
            let Continuous { z, l, active, rates, .. } = &*continuous;
            self.take_values([z, l, rates], active);
            self.instants.begun = Some(continuous.rates.clone());
            self.record_state(None);
        }
        self.instants.continuous = Some(continuous);
        found
    }

    /// The same by the derivative array of the network; from `charges` a run starts, near the present state or not.
    pub(in crate::integrate) fn by_derivative_array(
        &mut self,
        charges: Option<&[f64]>,
        start: Start,
    ) -> bool {
        let Some(mut array) = self.instants.array.take() else { return false };
        slopes(&self.waveforms, self.state.time, &mut self.instants.slopes);
        let instant = f64::EPSILON * self.schedule.step_length;
        let (linear, time) = (&self.solver.sys.linear, self.state.time);
        let (keeps, clock, frozen) = match &mut self.solver.smooth {
            Some(smooth) => (
                smooth.keeps(linear, &self.state.z, &self.state.u0, time, instant),
                smooth.clock(time),
                smooth.frozen.is_some(),
            ),
            None => (Vec::new(), time, false),
        };
        let proposal = self.instants.continuous.as_ref().and_then(|c| c.proposal());
        let conducts: Vec<bool> = self.state.l.iter().map(|l| *l > 0.0).collect();
        let known = if charges.is_some() { &conducts } else { &self.state.active };
        let at = Moment {
            sources: [&self.state.u0, &self.instants.slopes],
            time: [clock, if frozen { 0.0 } else { 1.0 }],
            roles: &self.state.roles,
            active: proposal.unwrap_or(known),
            zero: &self.instants.zero,
            keeps: &keeps,
            largest: self.instants.felt,
            charges,
            anew: charges.is_some() && start == Start::Cold,
        };
        let newton = self.solver.smooth.as_mut().map(|smooth| &mut smooth.newton);
        let found = array.find(linear, newton, [&self.state.z, &self.state.l], &at)
            && match charges {
                Some(_) => !self.jumps().noticed(charges, [&array.z; 3], &[]),
                None => self.jumps().keeps_charges(&array.z),
            };
        if found {
            let DerivativeArray { z, l, active, rates, .. } = &*array;
            self.take_values([z, l, rates], active);
            if let Some(smooth) = &mut self.solver.smooth {
                smooth.enter(&array.z, &self.state.u0, time, &array.function_rates);
            }
            // charges of junctions move immediately, and come to rest before a step has begun: it does not follow them; with
            // index 2 a stage that is given by its rates leaves the conditions of what is stored
            let follows = self.solver.smooth.is_none() && array.has_all_rates();
            self.instants.begun = follows.then(|| array.rates.clone());
            self.record_state(Some(&array.rates));
        }
        self.instants.array = Some(array);
        found
    }

    /// Hands the present state to the samples: a state, not a step; one of these rates shows what its rounding is
    /// measured by.
    fn record_state(&mut self, rates: Option<&[f64]>) {
        if self.recorder.samples.jumped() {
            self.state.u1.copy_from_slice(&self.state.u0);
            self.recorder.z_recorded.copy_from_slice(&self.state.z);
            let length = JUMP * self.jumps().shortest_time();
            let ahead = self.recorder.z_recorded.iter_mut().zip(rates.into_iter().flatten());
            ahead.for_each(|(z, rate)| *z += length * rate);
            self.recorder.record(&self.state, -length);
        }
    }
}
