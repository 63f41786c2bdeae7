//! Which mode follows: a chain of candidates, each proved or refuted by [`Verifier`].

use crate::mlcp::Role;
use crate::modewise::events::verify::{Finding, Scale, Verifier, OF_IMPULSE};
use crate::modewise::functions::inputs::Segment;
use crate::modewise::modes::implicit_step::{later, Implicit};
use crate::modewise::modes::mode::{Mode, Watch};
use crate::modewise::modes::prepared::Prepared;
use crate::modewise::modes::registry::{fingerprint, Id, Registry};
use crate::modewise::segments::trajectory::Trajectory;
use crate::modewise::series::scout::{Present, Refuted, Scout};
use crate::modewise::series::tableau::Tableau;
use crate::structure::Elements;
use crate::switch::Switch;
use crate::tolerances::LOST_BEYOND;
use std::sync::Arc;

/// Relative lengths of implicit steps tried one after the other.
const LENGTHS: [f64; 6] = [1.0, 1e2, 1e4, 1e-3, 1e6, 1e8];
/// Jumps in a row at one instant.
const PHASES: usize = 6;
/// Unknowns and pairs up to which modes are reduced without a look at signs.
const SMALL: usize = 64;
/// How often the noise of such a mode is widened.
const ASKED_AGAIN: usize = 4;

/// A jump of the energy coordinates on the way into a mode.
#[derive(Clone, Debug)]
pub struct StateJump {
    /// mode whose constraints caused it
    pub through: Id,
    /// before it
    pub before: Vec<f64>,
}

/// The choice.
pub struct Picked {
    /// number of the mode
    pub id: Id,
    /// the mode
    pub mode: Arc<Mode>,
}

/// Everything a choice depends on.
pub struct Scene<'a> {
    /// the system
    pub prepared: &'a Prepared,
    /// inputs from here on
    pub segment: &'a Segment,
    /// longest duration of the segment
    pub horizon: f64,
}

/// A mode that misses its guards.
struct Candidate {
    /// in units of their noise
    miss: f64,
    /// as a part of their values
    part: f64,
    id: Id,
    /// energy coordinates that it was tried from, and the jumps to there
    from: Vec<f64>,
    state_jumps: Vec<StateJump>,
}

/// Work space and memory of the choice.
#[derive(Default)]
pub struct Picker {
    /// the judge
    pub verifier: Verifier,
    /// jumps of the last choice
    pub state_jumps: Vec<StateJump>,
    on: Vec<bool>,
    gates: Vec<bool>,
    a: Vec<f64>,
    inputs: Vec<f64>,
    /// those that miss by little
    candidates: Vec<Candidate>,
    /// the last reason for which a mode could not be reduced
    pub trouble: Option<String>,
    /// judges modes before they are reduced, if the structure of the network is known
    scout: Option<Option<Scout>>,
}

/// Role of each pair for given switch states.
pub fn roles(m: usize, switches: &[Switch], gates: &[bool]) -> Vec<Role> {
    let mut out = vec![Role::Diode; m];
    for (switch, &gate) in switches.iter().zip(gates) {
        out[switch.pair] = switch.role(gate);
    }
    out
}

/// Turns pairs on and off as the switches require for given states, but for those that are diodes.
pub(in crate::modewise) fn fix(switches: &[Switch], gates: &[bool], on: &mut [bool]) {
    for (switch, &gate) in switches.iter().zip(gates) {
        match switch.role(gate) {
            Role::Diode => {}
            role => on[switch.pair] = role == Role::Closed,
        }
    }
}

impl Picker {
    /// What the signs of one solve say against a mode that has not been reduced.
    fn refuted(
        &mut self,
        scene: &Scene,
        registry: &Registry,
        id: Id,
        a: &[f64],
        scale: &Scale,
    ) -> Option<Refuted> {
        let Prepared { sys, net, switches, .. } = scene.prepared;
        // small modes are reduced, and neighbours derived, in hardly more time than a sparse matrix is factorised
        let derived = net.symmetric && switches.is_empty();
        if registry.is_made(id) || derived || net.n + net.m <= SMALL {
            return None;
        }
        let make = || {
            let elements =
                Elements::read(&sys.linear, &sys.capacitors, &sys.conductors, &sys.coordinates)?;
            Some(Scout::new(Tableau::new(elements, &sys.linear.q)?))
        };
        let scout = self.scout.get_or_insert_with(make).as_mut()?;
        let mut z = vec![0.0; net.n];
        net.big_r.apply(a, &mut z);
        let segment = scene.segment;
        let mut bending = Vec::new();
        segment.curvatures(&segment.rate, &mut bending);
        let [driven, rising, bending, most] = [&segment.now, &segment.rate, &bending, &scale.v]
            .map(|v| {
                let mut out = vec![0.0; net.n];
                net.s.apply(v, &mut out);
                out
            });
        let roles = roles(net.m, switches, registry.gates(id));
        let present = Present { z: &z, sources: [&driven, &rising, &bending], most: &most };
        scout.refute(registry.on(id), &roles, &present)
    }

    pub(in crate::modewise) fn attempt(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        id: Id,
        a: &[f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Result<Arc<Mode>, Finding> {
        if self.refuted(scene, registry, id, a, scale).is_some() {
            return Err(Finding::Signs);
        }
        let mode = match registry.mode(id, &scene.prepared.net, &scene.prepared.switches) {
            Ok(mode) => mode,
            Err(reason) => {
                self.trouble = Some(reason);
                return Err(Finding::Inconsistent);
            }
        };
        let found = self.verifier.verify(&mode, a, scene.segment, scene.horizon, scale, path);
        match found {
            Finding::Good => Ok(mode),
            other => {
                // the noise of an ill-conditioned guard may be all of it: what counts is how wrong it would be
                let missed = match other {
                    Finding::Guard(j, miss) => Some((miss, self.verifier.part_of(j, miss))),
                    Finding::Impulse(miss) => Some((miss, OF_IMPULSE * miss)),
                    _ => None,
                };
                if let Some((miss, part)) = missed.filter(|m| m.0 <= LOST_BEYOND) {
                    let (from, state_jumps) = (a.to_vec(), self.state_jumps.clone());
                    self.candidates.push(Candidate { miss, part, id, from, state_jumps });
                }
                Err(other)
            }
        }
    }

    /// The mode from here on. `from` is the mode so far, `cause` says what ended it and
    /// `crossing` which guards; `gates` are the switch states to keep. The energy coordinates
    /// `a` move to where jumps lead before the mode is entered.
    #[allow(clippy::too_many_arguments)] // the ingredients of a choice
    pub fn pick(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        implicit: &mut Implicit,
        from: Option<Id>,
        cause: u64,
        crossing: &[usize],
        gates: &[bool],
        a: &mut [f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Option<Picked> {
        (scale.widened, scale.coarse) = (1.0, false);
        if let Some(id) = from.and_then(|from| registry.follower(from, cause)) {
            if registry.gates(id) == gates {
                self.state_jumps.clear();
                self.candidates.clear();
                if let Ok(mode) = self.attempt(scene, registry, id, a, scale, path) {
                    return Some(Picked { id, mode });
                }
            }
        }
        let before = a.to_vec();
        let mut found =
            self.choose(scene, registry, implicit, from, crossing, gates, a, scale, path);
        // a guard that has fallen to zero and is above it again where its mode is entered is known no better than the
        // state is: it would go on so, a little at a time
        let returns = |id: Id| !crossing.is_empty() && Some(id) == from;
        let fine = found.is_some();
        if found.as_ref().is_none_or(|found| returns(found.id)) {
            a.copy_from_slice(&before);
            (scale.widened, scale.coarse) = (1.0, true);
            found = self.choose(scene, registry, implicit, from, crossing, gates, a, scale, path);
            if fine && found.is_none() {
                a.copy_from_slice(&before);
                (scale.widened, scale.coarse) = (1.0, false);
                found =
                    self.choose(scene, registry, implicit, from, crossing, gates, a, scale, path);
            }
        }
        if let (Some(from), Some(found)) = (from, &found) {
            if !returns(found.id) {
                registry.remember(from, cause, found.id);
            }
        }
        found
    }

    /// The mode from here on, among those next to the one so far and those that implicit steps find.
    #[allow(clippy::too_many_arguments)]
    fn choose(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        implicit: &mut Implicit,
        from: Option<Id>,
        crossing: &[usize],
        gates: &[bool],
        a: &mut [f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Option<Picked> {
        self.state_jumps.clear();
        self.candidates.clear();
        if let Some(from) = from {
            let found = self.flips(scene, registry, from, crossing, gates, a, scale, path);
            if found.is_some() {
                return found;
            }
        }
        let fastest = from
            .and_then(|id| registry.mode(id, &scene.prepared.net, &scene.prepared.switches).ok())
            .map_or(0.0, |m| m.fastest);
        self.afresh(scene, registry, implicit, fastest, gates, a, scale, path)
    }

    /// The mode so far with the guards that fail turned over: all together, then one by one.
    #[allow(clippy::too_many_arguments)]
    fn flips(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        from: Id,
        crossing: &[usize],
        gates: &[bool],
        a: &[f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Option<Picked> {
        let mut pairs = Vec::new();
        if let Ok(mode) = registry.mode(from, &scene.prepared.net, &scene.prepared.switches) {
            for &j in crossing {
                if let Watch::Pair(i) = mode.guards.watch[j] {
                    pairs.push(i);
                }
            }
        }
        self.gates.clear();
        self.gates.extend_from_slice(gates);
        let sets = if pairs.len() > 1 { 1 + pairs.len() } else { 1 };
        for k in 0..sets {
            self.on.clear();
            self.on.extend_from_slice(registry.on(from));
            fix(&scene.prepared.switches, gates, &mut self.on);
            let chosen: &[usize] = if k == 0 { &pairs } else { &pairs[k - 1..k] };
            for &i in chosen {
                self.on[i] = !self.on[i];
            }
            let id = registry.id(&self.on, &self.gates);
            match self.attempt(scene, registry, id, a, scale, path) {
                Ok(mode) => return Some(Picked { id, mode }),
                Err(Finding::Guard(..) | Finding::Signs) if k == 0 => {
                    let found = self.neighbours(scene, registry, id, gates, a, scale, path);
                    if found.is_some() {
                        return found;
                    }
                }
                Err(_) => {}
            }
        }
        None
    }

    /// The mode that an implicit step of small length finds, possibly after jumps.
    #[allow(clippy::too_many_arguments)]
    pub(in crate::modewise) fn by_steps(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        implicit: &mut Implicit,
        fastest: f64,
        gates: &[bool],
        a: &mut [f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Option<Picked> {
        let roles = roles(scene.prepared.net.m, &scene.prepared.switches, gates);
        let base =
            (1e-6 * scene.horizon).min(if fastest > 0.0 { 1e-3 / fastest } else { f64::INFINITY });
        let base = 10f64.powi(base.log10().floor() as i32);
        let mut tried: Vec<Id> = Vec::new();
        for length in LENGTHS {
            let h = base * length;
            if h > 0.1 * scene.horizon && length > 1.0 {
                continue;
            }
            self.a.clear();
            self.a.extend_from_slice(a);
            let mut now = std::mem::take(&mut self.a);
            self.state_jumps.clear();
            let mut found = None;
            for _ in 0..PHASES {
                later(scene.segment, h, &mut self.inputs);
                let taken = implicit.step(
                    &scene.prepared.sys,
                    &scene.prepared.net,
                    &now,
                    &self.inputs,
                    &roles,
                    h,
                );
                if !taken.is_ok_and(|t| !t.suspect) {
                    break;
                }
                self.on.clear();
                self.on.extend_from_slice(implicit.active());
                let id = registry.id(&self.on, gates);
                if tried.contains(&id) && self.state_jumps.is_empty() {
                    break; // refuted from here already
                }
                match self.attempt(scene, registry, id, &now, scale, path) {
                    Ok(mode) => {
                        found = Some(Picked { id, mode });
                        break;
                    }
                    Err(finding @ (Finding::Guard(..) | Finding::Signs)) => {
                        if let Some(picked) =
                            self.neighbours(scene, registry, id, gates, &now, scale, path)
                        {
                            found = Some(picked);
                            break;
                        }
                        if finding == Finding::Signs {
                            tried.push(id); // regular: no impulse leads into it
                            break;
                        }
                        // the impulse is right: jump, and look again
                        let Ok(mode) =
                            registry.mode(id, &scene.prepared.net, &scene.prepared.switches)
                        else {
                            break;
                        };
                        if mode.impulses.is_none() {
                            tried.push(id);
                            break;
                        }
                        self.state_jumps.push(StateJump { through: id, before: now.clone() });
                        settle(&mode, &scene.segment.now, &mut now);
                    }
                    Err(_) => {
                        tried.push(id);
                        break;
                    }
                }
            }
            if let Some(found) = found {
                a.copy_from_slice(&now);
                self.a = now;
                return Some(found);
            }
            self.a = now;
        }
        // the least violation, if it is little more than rounding
        self.state_jumps.clear();
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.sort_by(|a, b| a.part.total_cmp(&b.part));
        for Candidate { mut miss, id, from, state_jumps, .. } in candidates {
            // a guard that rises from rounding shows its sign later, by more
            for _ in 0..ASKED_AGAIN {
                // in units of noise: one that misses its guards by less may be the best there is
                if miss > fault!("least_violation_taken", LOST_BEYOND, f64::INFINITY) {
                    break;
                }
                scale.widened = 2.0 * miss;
                match self.attempt(scene, registry, id, &from, scale, path) {
                    Ok(mode) => {
                        a.copy_from_slice(&from);
                        self.state_jumps = state_jumps;
                        return Some(Picked { id, mode });
                    }
                    Err(Finding::Guard(_, again)) => miss *= 2.0 * again,
                    Err(_) => break,
                }
            }
        }
        None
    }

    /// Modes next to one whose guards fail: negative free guards turned over one after the other,
    /// then single guards that vanish.
    #[allow(clippy::too_many_arguments)]
    pub(in crate::modewise) fn neighbours(
        &mut self,
        scene: &Scene,
        registry: &mut Registry,
        id: Id,
        gates: &[bool],
        a: &[f64],
        scale: &mut Scale,
        path: &mut Trajectory,
    ) -> Option<Picked> {
        let mut current = id;
        let mut seen = vec![id];
        let (mut reduced, most) = (0, 24 + 2 * scene.prepared.net.m);
        while reduced < 24 && seen.len() < most {
            let pair = match self.refuted(scene, registry, current, a, scale) {
                Some(refuted) => refuted.worst,
                None => {
                    reduced += 1;
                    let mode = registry
                        .mode(current, &scene.prepared.net, &scene.prepared.switches)
                        .ok()?;
                    let Finding::Guard(worst, _) =
                        self.verifier.verify(&mode, a, scene.segment, scene.horizon, scale, path)
                    else {
                        break;
                    };
                    let Watch::Pair(pair) = mode.guards.watch[worst] else { break };
                    pair
                }
            };
            self.on.clear();
            self.on.extend_from_slice(registry.on(current));
            self.on[pair] = !self.on[pair];
            let next = registry.id(&self.on, gates);
            if seen.contains(&next) {
                break;
            }
            seen.push(next);
            current = next;
            if let Ok(mode) = self.attempt(scene, registry, next, a, scale, path) {
                return Some(Picked { id: next, mode });
            }
        }
        let zeros: Vec<usize> = match self.refuted(scene, registry, id, a, scale) {
            Some(refuted) => refuted.zeros,
            None => {
                let mode = registry.mode(id, &scene.prepared.net, &scene.prepared.switches).ok()?;
                self.verifier.verify(&mode, a, scene.segment, scene.horizon, scale, path);
                let watched = |&j: &usize| match mode.guards.watch[j] {
                    Watch::Pair(pair) => Some(pair),
                    Watch::Switch(_) => None,
                };
                self.verifier.zeros.iter().take(12).filter_map(watched).collect()
            }
        };
        for pair in zeros.into_iter().take(12) {
            self.on.clear();
            self.on.extend_from_slice(registry.on(id));
            self.on[pair] = !self.on[pair];
            let next = registry.id(&self.on, gates);
            if let Ok(mode) = self.attempt(scene, registry, next, a, scale, path) {
                return Some(Picked { id: next, mode });
            }
        }
        None
    }
}

/// Projects energy coordinates onto the constraints of a mode.
pub fn settle(mode: &Mode, inputs: &[f64], a: &mut [f64]) {
    let mut x = vec![0.0; mode.n];
    mode.enter(a, &mut x);
    fault!("half_a_jump" => {
        let before = a.to_vec();
        mode.leave(&x, inputs, a);
        a.iter_mut().zip(before).for_each(|(a, before)| *a = 0.5 * (*a + before));
        return;
    });
    mode.leave(&x, inputs, a);
}

/// Cause of a change: a breakpoint of the sources, or guards.
pub fn cause_of(crossing: &[usize], gates: &[bool]) -> u64 {
    let switches = gates.iter().enumerate().filter(|g| *g.1).map(|g| g.0);
    let first = fingerprint(1, crossing.iter().copied());
    fingerprint(first, switches)
}
