//! In which order the constraints are eliminated.
//!
//! The order of a scene's constraints is good for one cable, which is listed from end to end. Branches, loops and nets
//! want another: that of minimum degree, which takes trees from their leaves on. Which is the cheaper is counted on
//! S = J M⁻¹ Jᵀ + Σ before anything is factorised, not guessed from the topology: constraints that share two bodies close
//! loops and yet may cost nothing. An order of the trees from their leaves on with the rows that close loops last was no
//! cheaper than minimum degree in any scene.

use crate::{Form, UnknownName};
use std::fmt;
use std::str::FromStr;
use taut_model::{Linearized, Scene, SceneError, Slot};
use taut_solver::{
    Backend, BlockPattern, EliminationCost, SolveError, elimination_cost, minimum_degree,
};

/// The order in which the constraints stand in the linear system, which is that of elimination in the backends that do
/// not reorder, and that of the sweeps of block Gauss–Seidel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Elimination {
    /// [`Elimination::Scene`] where that fills nothing of what the backend factorises (all of S, its groups, or single
    /// blocks). Else the one that leaves fewer rows in the border of a chain ([`Backend::border_rows`]), the scene's where
    /// both leave as many, whose vectors need no permutation. Where neither is such a chain, the one of fewer
    /// floating-point operations. The scene's order is out where it takes more than eight times as many.
    #[default]
    Auto,
    /// The scene's own order.
    Scene,
    /// The order of minimum degree.
    MinimumDegree,
}

impl Elimination {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Auto, Self::Scene, Self::MinimumDegree];
}

impl fmt::Display for Elimination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Scene => "scene",
            Self::MinimumDegree => "minimum-degree",
        })
    }
}

impl FromStr for Elimination {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        let named = Self::ALL.into_iter().find(|e| e.to_string() == name);
        named.ok_or_else(|| UnknownName {
            what: "elimination",
            name: name.to_owned(),
            known: Self::ALL.map(|e| e.to_string()).join(", "),
        })
    }
}

/// The order that was taken, and what it costs.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct EliminationOrder {
    /// The order's kind; never [`Elimination::Auto`].
    pub taken: Elimination,
    /// The constraint at each position among the constraints of the linear system.
    pub constraints: Vec<usize>,
    /// Entries and floating-point operations of the block LDLᵀ in this order, of that part of S which the backend
    /// factorises; `None` beyond 10¹⁵ operations, which no step
    /// could make.
    pub cost: Option<EliminationCost>,
}

/// Most pairs of constraints with a dynamic body in common, of which each is a block of S: some gigabytes.
const MOST_PAIRS: usize = 20_000_000;

/// Refuses scenes whose S could not be stored: thousands of constraints on one body that moves.
pub(crate) fn check_size(scene: &Scene, rows: &Linearized) -> Result<(), SceneError> {
    let mut at_body = vec![0_usize; scene.bodies.len()];
    let dynamic = |slot: &&Slot| scene.bodies.is_dynamic(slot.body);
    for slot in rows.slots.iter().filter(dynamic) {
        at_body[slot.body] += 1;
    }
    let pairs = at_body.iter().map(|n| n.saturating_mul(*n) / 2);
    let pairs = pairs.fold(0_usize, usize::saturating_add);
    let most = at_body.iter().enumerate().max_by_key(|(_, n)| **n);
    match most {
        Some((body, _)) if pairs > MOST_PAIRS => Err(SceneError::Conflict {
            what: format!("body `{}`", scene.body_names[body]),
            reason: "has more joints than can be solved together: make it static or driven, or split it",
        }),
        _ => Ok(()),
    }
}

/// Nothing is counted beyond this.
pub(crate) const MOST: EliminationCost = EliminationCost {
    flops: 1_000_000_000_000_000,
    ..EliminationCost::MAX
};

/// Refuses what no machine factorises in the order of `pattern`.
pub(crate) fn check_fill(
    form: Form,
    backend: &Backend,
    order: &EliminationOrder,
    pattern: &BlockPattern,
) -> Result<(), SolveError> {
    let most = EliminationCost::LARGEST;
    if !backend.keeps_order() {
        return Ok(());
    }
    let cost = if form == Form::Kkt && !backend.is_iterative() {
        let natural: Vec<usize> = (0..pattern.blocks()).collect();
        elimination_cost(pattern, &natural, MOST)?
    } else {
        order.cost
    };
    let cost = cost.unwrap_or(MOST);
    if cost.is_within(most) {
        return Ok(());
    }
    Err(cost.too_large(most))
}

/// The order of the constraints for a backend.
pub(crate) fn order_of(
    wanted: Elimination,
    scene: &Scene,
    rows: &Linearized,
    backend: &Backend,
) -> Result<EliminationOrder, SolveError> {
    let pattern = factorized(scene, rows, backend)?;
    let counted = |taken, most| {
        let constraints = match taken {
            Elimination::MinimumDegree => minimum_degree(&pattern),
            Elimination::Auto | Elimination::Scene => (0..pattern.blocks()).collect(),
        };
        let cost = elimination_cost(&pattern, &constraints, most)?;
        Ok(EliminationOrder {
            taken,
            constraints,
            cost,
        })
    };
    if wanted != Elimination::Auto {
        return counted(wanted, MOST);
    }
    let unfilled = counted(Elimination::Scene, EliminationCost::without_fill(&pattern))?;
    if unfilled.cost.is_some() {
        return Ok(unfilled);
    }
    let least = counted(Elimination::MinimumDegree, MOST)?;
    // It bounds what counting the other takes. Operations in the scene's order count leaves behind a chain as if they were
    // carried along it, which `banded` avoids.
    let flops = |order: &EliminationOrder| order.cost.unwrap_or(MOST).flops;
    let largest = EliminationCost::LARGEST;
    let most = EliminationCost {
        flops: flops(&least).saturating_mul(8).min(largest.flops),
        ..largest
    };
    let own = counted(Elimination::Scene, most)?;
    if own.cost.is_none() {
        return Ok(least);
    }
    let border = |order: &EliminationOrder| backend.border_rows(&pattern, &order.constraints);
    let is_own = match (border(&own)?, border(&least)?) {
        (Some(own), least) => least.is_none_or(|least| own <= least),
        (None, Some(_)) => false,
        (None, None) => flops(&own) <= flops(&least),
    };
    Ok(if is_own { own } else { least })
}

/// The pattern of what the backend factorises, constraint by constraint in the scene's order: S, its groups' diagonal
/// parts, or its diagonal blocks.
pub(crate) fn factorized(
    scene: &Scene,
    rows: &Linearized,
    backend: &Backend,
) -> Result<BlockPattern, SolveError> {
    let grouped = |c: usize| (c, scene.groups[c]);
    let coupled = |a: usize, b: usize| backend.factorizes(grouped(a), grouped(b));
    let mut at_body = vec![Vec::new(); scene.bodies.len()];
    let dynamic = |slot: &&Slot| scene.bodies.is_dynamic(slot.body);
    for slot in rows.slots.iter().filter(dynamic) {
        at_body[slot.body].push(slot.constraint);
    }
    let mut couplings = Vec::new();
    for constraints in &mut at_body {
        constraints.dedup();
        for (i, &a) in constraints.iter().enumerate() {
            let before = constraints[..i].iter().filter(|&&b| coupled(a, b));
            couplings.extend(before.map(|&b| (a, b)));
        }
    }
    let sizes: Vec<usize> = (0..rows.constraints())
        .map(|c| rows.row_range(c).len())
        .collect();
    BlockPattern::new(&sizes, &couplings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::With;
    use crate::testing::centre;

    fn auto(scene: &Scene, backend: &Backend) -> EliminationOrder {
        let rows = Linearized::new(scene);
        order_of(Elimination::Auto, scene, &rows, backend).unwrap()
    }

    /// Scenes without loops keep every bit of their results: `Auto` takes the scene's own order for
    /// them.
    #[test]
    fn scenes_without_loops_keep_their_order() {
        for name in taut_model::named::NAMES {
            let scene = taut_model::named(name).unwrap();
            let order = auto(&scene, &Backend::Banded);
            if taut_model::Network::named(name).is_some() {
                let rows = Linearized::new(&scene);
                let own = order_of(Elimination::Scene, &scene, &rows, &Backend::Banded).unwrap();
                let flops = |order: &EliminationOrder| order.cost.unwrap().flops;
                assert!(flops(&order) <= flops(&own), "{name}");
                continue;
            }
            assert_eq!(order.taken, Elimination::Scene, "{name}: {:?}", order.cost);
            assert!(order.constraints.into_iter().eq(0..scene.constraints.len()));
        }
    }

    /// A factor beyond memory or time is refused before its analysis, where the backend keeps the
    /// order.
    #[test]
    fn factors_beyond_reach_are_refused() {
        let scene = taut_model::named("net").unwrap();
        let rows = Linearized::new(&scene);
        let pattern = factorized(&scene, &rows, &Backend::Banded).unwrap();
        let own = order_of(Elimination::Scene, &scene, &rows, &Backend::Banded).unwrap();
        let refused = |backend: &str, cost| {
            let order = own.clone().with(|p| p.cost = cost);
            let backend = backend.parse().unwrap();
            check_fill(Form::Schur, &backend, &order, &pattern).is_err()
        };
        let most = EliminationCost::LARGEST;
        let (entries, flops) = (most.entries + 1, most.flops + 1);
        for beyond in [
            None,
            Some(EliminationCost { entries, ..most }),
            Some(EliminationCost { flops, ..most }),
        ] {
            for (backend, is_refused) in [
                ("banded", true),
                ("faer:ldlt", true),
                ("faer:lblt", true),
                ("cg:group", true),
                ("faer:lu", false),
                ("umfpack", false),
                ("cg:jacobi", false),
            ] {
                assert_eq!(refused(backend, beyond), is_refused, "{backend}");
                assert!(!refused(backend, Some(most)) && !refused(backend, own.cost));
            }
        }
    }

    /// Rows of the border in the order that is taken.
    #[cfg(feature = "banded")]
    fn border_rows(scene: &Scene) -> Option<usize> {
        let backend = Backend::Banded;
        let order = auto(scene, &backend);
        let pattern = factorized(scene, &Linearized::new(scene), &backend).unwrap();
        backend.border_rows(&pattern, &order.constraints).unwrap()
    }

    /// One joint of a ring is enough.
    #[test]
    #[cfg(feature = "banded")]
    fn loops_get_no_more_border_rows_than_close_them() {
        use taut_model::{JointKind, Network, NetworkParams};
        for (joint, rows) in [(JointKind::Cosserat, 6), (JointKind::Spherical, 3)] {
            for (segments, points) in [
                (8, 1),
                (8, 2),
                (24, 1),
                (24, 2),
                (25, 1),
                (100, 2),
                (1000, 1),
            ] {
                let params = NetworkParams::new(Network::Ring)
                    .with(|p| (p.segments, p.points, p.joint) = (segments, points, joint));
                let ring = params.build().unwrap();
                let name = format!("{joint:?} {segments} {points}");
                assert_eq!(border_rows(&ring), Some(rows), "{name}");
                let taken = auto(&ring, &Backend::Banded).taken;
                assert_eq!(taken, Elimination::Scene, "{name}");
            }
        }
        // A cable from point to point with its load in the middle is a chain; of three that meet one joint is too many.
        for (network, rows) in [(Network::Cranes, 0), (Network::Junction, 3)] {
            let scene = NetworkParams::new(network).build().unwrap();
            assert_eq!(border_rows(&scene), Some(rows), "{network:?}");
        }
    }

    /// Hooks on all segments, listed behind the cable, are carried along it in the scene's order: too many of them.
    #[test]
    fn many_leaves_at_the_end_are_not_carried_along() {
        use taut_model::{Body, Constraint, HoistParams, Spherical};
        let with_hooks = |segments| {
            let params = HoistParams::default().with(|p| p.segments = segments);
            let mut scene = params.build().unwrap();
            let joint = scene.constraints.iter().find_map(|c| match c {
                Constraint::Spherical(joint) => Some(*joint),
                _ => None,
            });
            let joint = joint.unwrap();
            for segment in 0..segments {
                let hook = scene.add_body(format!("hook-{segment}"), Body::sphere(0.1, 1.0));
                let frames = [segment, hook].map(centre);
                let joint = Constraint::Spherical(Spherical { frames, ..joint });
                scene.add_constraint(format!("hook-joint-{segment}"), joint, 0);
            }
            auto(&scene, &Backend::Banded).taken
        };
        assert_eq!(with_hooks(500), Elimination::MinimumDegree);
    }

    /// A hoist listed with every second joint first: S fills, and so does each of two groups that take turns, but not
    /// the single blocks of other iterations.
    #[test]
    fn only_what_the_backend_factorises_counts() {
        let mut scene = taut_model::HoistParams::default().build().unwrap();
        let n = scene.constraints.len();
        let listed: Vec<usize> = (0..n).step_by(2).chain((1..n).step_by(2)).collect();
        scene.constraints = listed
            .iter()
            .map(|&c| scene.constraints[c].clone())
            .collect();
        let banded = auto(&scene, &Backend::Banded);
        assert_eq!(banded.taken, Elimination::MinimumDegree);
        assert!(banded.constraints.iter().map(|&k| listed[k]).eq(0..n));
        let named = |name: &str| name.parse::<Backend>().unwrap();
        for name in ["cg:none", "cg:jacobi", "gauss-seidel:joints"] {
            let found = auto(&scene, &named(name)).taken;
            assert_eq!(found, Elimination::Scene, "{name}");
        }
        for (groups, taken) in [
            (vec![0; n], Elimination::MinimumDegree),
            // Joints that share no body.
            (
                (0..n).map(|k| u32::from(2 * k > n)).collect(),
                Elimination::Scene,
            ),
        ] {
            scene.groups = groups;
            for name in ["cg:group", "gauss-seidel:groups"] {
                assert_eq!(auto(&scene, &named(name)).taken, taken, "{name}");
            }
        }
    }
}
