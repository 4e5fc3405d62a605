//! The graph of a scene: which bodies hang together, which constraints close loops.
//!
//! Bodies are vertices and constraints hyperedges between them. The world and static and driven bodies are no vertices:
//! forces do not move them, and two constraints that share nothing else are not coupled in S = J M⁻¹ Jᵀ + Σ. What closes
//! no loop forms a tree in each connected component, and S of a tree, eliminated from the leaves to a root, fills
//! nothing: what is left to eliminate next to a constraint shares its one body towards the root. Constraints that close
//! loops make one more group, \[SL §VI-A], which need not be a forest itself. Constraints that share two bodies close a loop
//! in this sense too, as links and the bend rows between them do.

use crate::constraint::Constraint;
use crate::scene::Scene;

/// Components, loops and groups of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Topology {
    /// Number of connected components, dynamic bodies without constraints included.
    pub components: usize,
    /// Component of each body, numbered by their first bodies; `None` for a static or driven one.
    pub component_of_body: Vec<Option<usize>>,
    /// Component of each constraint; `None` where it acts on no dynamic body.
    pub component_of_constraint: Vec<Option<usize>>,
    /// The constraints that close a loop, ascending: those with two different dynamic bodies that
    /// constraints before them connect.
    pub closing: Vec<usize>,
    /// Group of each constraint, for [`Scene::groups`]: one for each component, numbered by their first constraints, and
    /// after them one for all that close loops.
    pub groups: Vec<u32>,
}

impl Topology {
    /// The topology of a scene. Time O(N α(N)) in the number N of sides of constraints, with the inverse Ackermann
    /// function α. Allocates: yes.
    ///
    /// # Panics
    /// When a constraint names a body that is not there.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let bodies = scene.bodies.len();
        let edges = Edges::of(scene);
        let mut sets = DisjointSets::new(bodies);
        let mut closing = Vec::new();
        let mut closes = vec![false; edges.len()];
        for (c, closes) in closes.iter_mut().enumerate() {
            for pair in edges.vertices(c).windows(2) {
                *closes |= !sets.join(pair[0], pair[1]);
            }
            if *closes {
                closing.push(c);
            }
        }

        let mut components = 0;
        let mut component_of_root = vec![None; bodies];
        let mut component_of_body = vec![None; bodies];
        for (body, component) in component_of_body.iter_mut().enumerate() {
            if !scene.bodies.is_dynamic(body) {
                continue;
            }
            let of_root = &mut component_of_root[sets.root(body)];
            *component = Some(*of_root.get_or_insert_with(|| {
                components += 1;
                components - 1
            }));
        }
        let of_constraint = |c: usize| component_of_body[*edges.vertices(c).first()?];
        let component_of_constraint: Vec<_> = (0..edges.len()).map(of_constraint).collect();
        Self {
            components,
            groups: groups(&component_of_constraint, components, &closes),
            component_of_body,
            component_of_constraint,
            closing,
        }
    }
}

impl Scene {
    /// Puts the constraints into the fewest groups with tree topology: one a connected component, and one more for
    /// those that close loops. See [`Topology::groups`].
    ///
    /// # Panics
    /// As [`Topology::of`].
    pub fn group_by_topology(&mut self) {
        self.groups = Topology::of(self).groups;
    }
}

/// Groups from components: numbered as they are met, those of the closing constraints last.
fn groups(component: &[Option<usize>], components: usize, closes: &[bool]) -> Vec<u32> {
    let mut met = 0_u32;
    let mut group = vec![None; components];
    let mut numbered: Vec<Option<u32>> = Vec::with_capacity(component.len());
    for (component, closes) in component.iter().zip(closes) {
        numbered.push(match component {
            _ if *closes => None,
            // Coupled to nothing, it may be in any group.
            None => Some(0),
            Some(component) => Some(*group[*component].get_or_insert_with(|| {
                met += 1;
                met - 1
            })),
        });
    }
    numbered.into_iter().map(|g| g.unwrap_or(met)).collect()
}

/// The hyperedges: the different vertices that each constraint acts on.
struct Edges {
    /// First of each constraint's vertices, and their number at the end.
    start: Vec<usize>,
    /// Ascending for each constraint.
    vertices: Vec<usize>,
}

impl Edges {
    fn of(scene: &Scene) -> Self {
        let mut edges = Self {
            start: vec![0],
            vertices: Vec::new(),
        };
        for constraint in &scene.constraints {
            let mut own: Vec<usize> = vertices(scene, constraint).collect();
            own.sort_unstable();
            own.dedup();
            edges.vertices.extend(own);
            edges.start.push(edges.vertices.len());
        }
        edges
    }

    fn len(&self) -> usize {
        self.start.len() - 1
    }

    fn vertices(&self, constraint: usize) -> &[usize] {
        &self.vertices[self.start[constraint]..self.start[constraint + 1]]
    }
}

/// The vertices that a constraint acts on, side by side: the one place that says what is one.
fn vertices(scene: &Scene, constraint: &Constraint) -> impl Iterator<Item = usize> {
    let bodies = constraint.bodies();
    bodies.filter(|&body| scene.bodies.is_dynamic(body))
}

/// Disjoint sets of bodies, by size and with halved paths.
struct DisjointSets {
    parent: Vec<usize>,
    size: Vec<usize>,
}

impl DisjointSets {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count).collect(),
            size: vec![1; count],
        }
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.parent[i] != i {
            self.parent[i] = self.parent[self.parent[i]];
            i = self.parent[i];
        }
        i
    }

    /// Joins the sets of two elements; `false` where they were one already.
    fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return false;
        }
        let (small, large) = if self.size[a] < self.size[b] {
            (a, b)
        } else {
            (b, a)
        };
        self.parent[small] = large;
        self.size[large] += self.size[small];
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;

    fn frame(body: Option<usize>) -> Frame {
        let world = origin();
        body.map_or(world, |i| Frame::body(i, Vector3::x()))
    }

    /// A scene of so many bodies, with a constraint through each of the lists of sides; `None` is the world.
    fn scene(bodies: usize, constraints: &[&[Option<usize>]]) -> Scene {
        let mut scene = Scene::new("graph");
        for i in 0..bodies {
            scene.add_body(format!("body-{i}"), Body::sphere(0.1, 1.0));
        }
        for (c, sides) in constraints.iter().enumerate() {
            let constraint = match *sides {
                &[a, b] => Constraint::Spherical(Spherical {
                    frames: [frame(a), frame(b)],
                    stretch: RowLaw::RIGID,
                }),
                sides => Constraint::MasslessCable(MasslessCable {
                    frames: sides.iter().map(|&s| frame(s)).collect(),
                    sheaves: Vec::new(),
                    length: 1.0,
                    law: RowLaw::RIGID,
                    winch: None,
                    tension_only: false,
                }),
            };
            scene.add_constraint(format!("constraint-{c}"), constraint, 7);
        }
        scene
    }

    #[test]
    fn a_y_is_one_tree() {
        // Two arms meet in body 2, the third hangs from it; both arms are anchored to the world.
        let (w, b) = (None, Some);
        let sides: [&[_]; 6] = [
            &[w, b(0)],
            &[b(0), b(2)],
            &[w, b(1)],
            &[b(1), b(2)],
            &[b(2), b(3)],
            &[b(3), b(4)],
        ];
        let mut y = scene(5, &sides);
        let t = Topology::of(&y);
        assert_eq!((t.components, t.closing.is_empty()), (1, true));
        y.group_by_topology();
        assert_eq!(y.groups, [0; 6]);
        assert_eq!(y.validate(), Ok(()));
    }

    #[test]
    fn parts_and_bodies_alone_are_components() {
        let t = Topology::of(&scene(
            6,
            &[&[Some(4), Some(5)], &[Some(1), Some(2)], &[None, Some(2)]],
        ));
        assert_eq!(t.components, 4);
        assert_eq!(t.component_of_body, [0, 1, 1, 2, 3, 3].map(Some));
        assert_eq!(t.component_of_constraint, [3, 1, 1].map(Some));
        assert_eq!(t.groups, [0, 1, 1]);
        assert_eq!(Topology::of(&Scene::new("none")), Topology::default());
    }

    #[test]
    fn rings_close_with_their_last_constraint() {
        let ring = |first: usize, n: usize| (0..n).map(move |i| [first + i, first + (i + 1) % n]);
        // A ring of four bodies and one of three.
        let pairs: Vec<_> = ring(0, 4).chain(ring(4, 3)).collect();
        let sides: Vec<_> = pairs.iter().map(|p| p.map(Some)).collect();
        let sides: Vec<&[_]> = sides.iter().map(<[_; 2]>::as_slice).collect();
        let t = Topology::of(&scene(7, &sides));
        assert_eq!((t.components, t.closing.as_slice()), (2, &[3, 6][..]));
        assert_eq!(t.groups, [0, 0, 0, 2, 1, 1, 2]);
        // Both ends held by the world: no loop.
        let t = Topology::of(&scene(
            2,
            &[&[None, Some(0)], &[Some(0), Some(1)], &[Some(1), None]],
        ));
        assert!(t.closing.is_empty());
    }

    #[test]
    fn what_does_not_move_couples_nothing() {
        let sides: [&[_]; 4] = [
            &[Some(0), Some(1)],
            &[Some(1), Some(2)],
            &[Some(2), Some(0)],
            &[Some(1), None],
        ];
        let mut scene = scene(3, &sides);
        assert_eq!(Topology::of(&scene).closing, [2]);
        scene.bodies.mobility[1] = Mobility::Driven;
        let t = Topology::of(&scene);
        assert_eq!((t.components, t.closing.is_empty()), (1, true));
        assert_eq!(t.component_of_body, [Some(0), None, Some(0)]);
        assert_eq!(t.component_of_constraint, [Some(0), Some(0), Some(0), None]);
        scene.bodies.mobility[0] = Mobility::Static;
        assert!(Topology::of(&scene).closing.is_empty());
    }

    #[test]
    fn constraints_of_many_sides_are_hyperedges() {
        let (w, b) = (None, Some);
        // Through one body twice: no loop. The second closes one, for bodies 0 and 1 are connected; it connects body 3,
        // so that the third closes one too.
        let sides: [&[_]; 3] = [
            &[w, b(0), b(1), b(0), b(2)],
            &[b(3), b(1), b(0)],
            &[b(3), b(2)],
        ];
        let t = Topology::of(&scene(4, &sides));
        assert_eq!((t.components, t.closing.as_slice()), (1, &[1, 2][..]));
        // The links of a chain and the bend rows between them.
        let chain = named("particles-e").expect("builds");
        assert!(!Topology::of(&chain).closing.is_empty());
        assert!(
            Topology::of(&named("hoist").expect("builds"))
                .closing
                .is_empty()
        );
    }

    /// Neither recursion nor quadratic time.
    #[test]
    fn a_chain_of_100_000_bodies_is_one_tree() {
        let n = 100_000;
        let sides: Vec<_> = (1..n).map(|i| [Some(i - 1), Some(i)]).collect();
        let sides: Vec<&[_]> = sides.iter().map(<[_; 2]>::as_slice).collect();
        let t = Topology::of(&scene(n, &sides));
        assert_eq!((t.components, t.closing.is_empty()), (1, true));
    }
}
