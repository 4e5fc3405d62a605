//! Elasticity of cables: materials, cross-sections, stiffnesses and the compliance of joints \[SL §IV].

use std::f64::consts::PI;

use crate::constraint::{JointLaw, RowLaw};
use crate::error::SceneError;

/// An isotropic elastic material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus Y \[Pa].
    pub young: f64,
    /// Poisson's ratio ν, −1 < ν ≤ 0.5.
    pub poisson: f64,
    /// Density ρ \[kg/m³].
    pub density: f64,
}

/// A round cable with all defaults worked out: [`Material::round`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct RoundCable {
    /// \[m]
    pub(crate) radius: f64,
    pub(crate) stiffness: Stiffness,
    /// Mass per length of a solid one \[kg/m].
    pub(crate) density: f64,
}

impl Material {
    /// Solid steel.
    pub const STEEL: Self = Self {
        young: 2e11,
        poisson: 0.3,
        density: 7850.0,
    };
    /// Nylon.
    pub const NYLON: Self = Self {
        young: 3e9,
        poisson: 0.4,
        density: 1150.0,
    };
    /// Soft rubber.
    pub const RUBBER: Self = Self {
        young: 1e7,
        poisson: 0.49,
        density: 1100.0,
    };

    /// Names for [`Material::named`].
    pub const NAMES: [&'static str; 3] = ["steel", "nylon", "rubber"];

    /// The material called `name` (`steel`, `nylon`, `rubber`).
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let number = Self::NAMES.iter().position(|known| *known == name)?;
        Some([Self::STEEL, Self::NYLON, Self::RUBBER][number])
    }

    /// As [`Material::named`], with an error that lists the names.
    pub(crate) fn find(name: &str) -> Result<Self, SceneError> {
        Self::named(name).ok_or_else(|| SceneError::UnknownName {
            what: "material",
            name: name.to_owned(),
            known: Self::NAMES.map(str::to_owned).to_vec(),
        })
    }

    /// A round cable with the axial stiffness `ea` (N): radius (m), EI and GJ (N m²) are those of a solid one where they are not
    /// given.
    pub(crate) fn round(
        &self,
        ea: f64,
        radius: Option<f64>,
        ei_gj: [Option<f64>; 2],
    ) -> RoundCable {
        let radius = radius.unwrap_or_else(|| self.round_radius(ea));
        RoundCable {
            radius,
            stiffness: Stiffness::of_round(ea, radius, self.poisson, ei_gj),
            density: self.density * CrossSection::Circle { radius }.area(),
        }
    }

    /// Axial stiffness of a solid round cable with that radius (m) \[N].
    pub(crate) fn round_stiffness(&self, radius: f64) -> f64 {
        self.young * CrossSection::Circle { radius }.area()
    }

    /// Radius of a solid round cable with axial stiffness `ea` (N) \[m].
    #[must_use]
    pub fn round_radius(&self, ea: f64) -> f64 {
        (ea / (PI * self.young)).sqrt()
    }
}

/// Cross-section of a solid cable.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum CrossSection {
    /// A disc.
    Circle {
        /// Radius \[m].
        radius: f64,
    },
    /// A square.
    Square {
        /// Edge length h \[m].
        side: f64,
    },
}

impl CrossSection {
    /// Area A \[m²].
    #[must_use]
    pub fn area(&self) -> f64 {
        match *self {
            Self::Circle { radius } => PI * radius * radius,
            Self::Square { side } => side * side,
        }
    }

    /// Second moment of area I_a about a transverse axis \[m⁴]: πr⁴/4, h⁴/12.
    #[must_use]
    pub fn second_moment(&self) -> f64 {
        match *self {
            Self::Circle { radius } => PI * radius.powi(4) / 4.0,
            Self::Square { side } => side.powi(4) / 12.0,
        }
    }

    /// Torsion constant J_t \[m⁴]: 2 I_a for the disc, 0.1406 h⁴ for the square (Saint-Venant's series).
    /// The paper writes I_a.
    #[must_use]
    pub fn torsion_constant(&self) -> f64 {
        match *self {
            Self::Circle { .. } => 2.0 * self.second_moment(),
            Self::Square { side } => 0.140_577_014_955_153_65 * side.powi(4),
        }
    }
}

/// Stiffness of a cable per unit length. Wire ropes are softer than their solid material: give measured values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness {
    /// Axial stiffness YA \[N].
    pub ea: f64,
    /// Bending stiffness YI \[N m²].
    pub ei: f64,
    /// Torsional stiffness GJ \[N m²].
    pub gj: f64,
}

impl Stiffness {
    /// Stiffness of a solid cable: YA, Y I_a, G J_t with the shear modulus G = Y/(2(1+ν)).
    #[must_use]
    pub fn new(material: &Material, section: &CrossSection) -> Self {
        let shear = material.young / (2.0 * (1.0 + material.poisson));
        Self {
            ea: material.young * section.area(),
            ei: material.young * section.second_moment(),
            gj: shear * section.torsion_constant(),
        }
    }

    /// Stiffness of a round cable with axial stiffness `ea` (N) and `radius` (m): `ei` and `gj` (N m²) where they are given,
    /// else those of a solid one, EI = EA r²/4 and GJ = EI/(1 + ν).
    #[must_use]
    pub fn of_round(ea: f64, radius: f64, poisson: f64, [ei, gj]: [Option<f64>; 2]) -> Self {
        let ei = ei.unwrap_or(0.25 * ea * radius * radius);
        Self {
            ea,
            ei,
            gj: gj.unwrap_or(ei / (1.0 + poisson)),
        }
    }

    /// Laws of a joint that stands for the length `length` (m) of cable, with all rows damped by `damping` (s):
    /// ε = l/YA, l/YI, l/GJ. For neighbouring segments l = (l_a + l_b)/2, the distance of their centres \[SL (34)–(36),
    /// which hold with half lengths].
    #[must_use]
    pub fn joint_law(&self, length: f64, damping: f64) -> JointLaw {
        let law = |stiffness: f64| Some(RowLaw::new(length / stiffness, damping));
        JointLaw {
            stretch: law(self.ea),
            bend: law(self.ei),
            twist: law(self.gj),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circle_of_steel() {
        let radius = 0.01;
        let s = Stiffness::new(&Material::STEEL, &CrossSection::Circle { radius });
        assert!((s.ea - 2e11 * PI * 1e-4).abs() < 1e-6);
        assert!((s.ei - 0.25 * s.ea * radius * radius).abs() < 1e-10);
        // G·2I = EI/(1+ν) for a circle.
        assert!((s.gj - s.ei / 1.3).abs() < 1e-10);
    }

    #[test]
    fn torsion_constant_of_a_square_is_saint_venant_s() {
        let series: f64 = (0..2000)
            .map(|k| {
                let n = f64::from(2 * k + 1);
                (n * PI / 2.0).tanh() / n.powi(5)
            })
            .sum();
        let exact = (1.0 - 192.0 / PI.powi(5) * series) / 3.0;
        let square = CrossSection::Square { side: 1.0 };
        assert!((square.torsion_constant() - exact).abs() < 1e-14);
        assert_eq!(square.area(), 1.0);
        assert_eq!(square.second_moment(), 1.0 / 12.0);
    }

    #[test]
    fn joint_compliance_is_length_over_stiffness() {
        let s = Stiffness {
            ea: 10.0,
            ei: 4.0,
            gj: 2.0,
        };
        let law = s.joint_law(0.5, 0.1);
        assert_eq!(law.stretch, Some(RowLaw::new(0.05, 0.1)));
        assert_eq!(law.bend, Some(RowLaw::new(0.125, 0.1)));
        assert_eq!(law.twist, Some(RowLaw::new(0.25, 0.1)));
    }

    #[test]
    fn names_are_materials() {
        for name in Material::NAMES {
            assert!(Material::named(name).is_some());
        }
        assert_eq!(Material::named("wood"), None);
    }
}
