//! Dimensions and masses of the leg.

use crate::linkage::{ActuatorBody, LineActuator};
use vpm_core::{Error, Result};

/// How a cylinder is attached around a joint: its base at `base` from the axis, its tip at `tip`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attachment {
    /// Distance of the base from the joint axis, in m.
    pub base: f64,
    /// Angle of the base, in rad: at the hip above the forward horizontal, at the knee ahead of the line to the hip.
    pub base_angle: f64,
    /// Distance of the tip from the joint axis, in m.
    pub tip: f64,
    /// Angle of the tip behind the axis of the leg that it sits on, in rad.
    pub tip_angle: f64,
}

/// Upper or lower leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegBody {
    /// Distance between its axes (or to the foot), in m.
    pub length: f64,
    /// Mass in kg.
    pub mass: f64,
    /// Rotational inertia about the centre of mass, normal to the plane, in kg m^2.
    pub inertia: f64,
    /// Centre of mass from the upper axis: along the leg, and ahead of it (m).
    pub center: [f64; 2],
}

/// Everything that a leg is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LegParameters {
    /// Mass of the slider in kg, with its centre of mass at the hip axis.
    pub slider_mass: f64,
    /// The upper leg, from hip to knee.
    pub upper: LegBody,
    /// The lower leg, from knee to foot.
    pub lower: LegBody,
    /// Where the hip and the knee cylinder are attached.
    pub attachments: [Attachment; 2],
    /// Hip and knee cylinder.
    pub actuators: [LineActuator; 2],
    /// Gravity in m/s^2, downward.
    pub gravity: f64,
}

/// Which published masses and inertias of HyQ to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HyqData {
    /// The CAD column of Table 5.1. Its inertias are too small for motion in the plane by one order.
    Cad,
    /// The identified column of Table 5.1.
    Identified,
    /// Masses of the CAD column, with inertias of slender bodies and of the public model of the lower leg.
    Plausible,
}

/// The leg, with checked parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    pub(super) parameters: LegParameters,
}

impl LegParameters {
    /// Parameters of the HyQ leg; `shank` is the distance from knee to foot in m. It is 0.341, or 0.375 to meet the
    /// published shares.
    ///
    /// Geometry: "HyQ-Robot: Standard definition for joint angles and kinematic parameters", V4.0, 2017. Masses: Table
    /// 5.1 of the thesis, which lists one inertia per actuator: it is divided between barrel and rod by mass, or
    /// equally for the identified column. Centres of mass are not published: 0.14 and 0.1254 m down the legs, 0.110 and
    /// 0.090 m along the cylinders.
    pub fn hyq(data: HyqData, shank: f64) -> Self {
        let cad = [7.360, 0.885, 0.876, 1.216, 0.215, 1.214, 0.215];
        let split =
            |inertia: f64, barrel: f64, rod: f64| [inertia * barrel, inertia * rod].map(|part| part / (barrel + rod));
        let ([hip_barrel, hip_rod], [knee_barrel, knee_rod]) =
            (split(0.338e-3, cad[3], cad[4]), split(0.769e-3, cad[5], cad[6]));
        let (masses, inertias) = match data {
            HyqData::Cad => (cad, [2.75e-3, 0.325e-3, hip_barrel, hip_rod, knee_barrel, knee_rod]),
            HyqData::Identified => (
                [7.122, 1.223, 1.176, 0.994, 0.222, 1.080, 0.217],
                [2.75e-3, 0.325e-3, 0.0075e-3, 0.0075e-3, 0.0075e-3, 0.0075e-3],
            ),
            HyqData::Plausible => (cad, [9.3e-3, 1.23e-2, 1.0e-2, 2e-3, 1.0e-2, 2e-3]),
        };
        let leg = |k: usize, length, along| LegBody {
            length,
            mass: masses[k],
            inertia: inertias[k - 1],
            center: [along, 0.0],
        };
        let part = |k: usize, center| ActuatorBody { mass: masses[k], inertia: inertias[k - 1], center };
        let actuator = |k: usize| LineActuator { barrel: part(k, 0.110), rod: part(k + 1, 0.090) };
        Self {
            slider_mass: masses[0],
            upper: leg(1, 0.350, 0.14),
            lower: leg(2, shank, 0.1254),
            attachments: [
                Attachment { base: 0.3219, base_angle: 6.24_f64.to_radians(), tip: 0.045, tip_angle: 0.0 },
                Attachment {
                    base: 0.3218,
                    base_angle: 8.04_f64.to_radians(),
                    tip: 0.045,
                    tip_angle: 6.0_f64.to_radians(),
                },
            ],
            actuators: [actuator(3), actuator(5)],
            gravity: 9.81,
        }
    }

    /// Every parameter of the leg with its name, whether it has to be positive, and whether zero will do.
    fn named(&self) -> Vec<(String, f64, Sign)> {
        let mut list = vec![("slider.mass".to_owned(), self.slider_mass, Sign::NotNegative)];
        list.push(("gravity".to_owned(), self.gravity, Sign::Any));
        for (name, body) in [("upper", &self.upper), ("lower", &self.lower)] {
            list.push((format!("{name}.length"), body.length, Sign::Positive));
            list.push((format!("{name}.mass"), body.mass, Sign::Positive));
            list.push((format!("{name}.inertia"), body.inertia, Sign::NotNegative));
            list.extend(body.center.map(|entry| (format!("{name}.center"), entry, Sign::Any)));
        }
        for ((name, place), actuator) in ["hip", "knee"].into_iter().zip(&self.attachments).zip(&self.actuators) {
            list.push((format!("{name}.base"), place.base, Sign::Positive));
            list.push((format!("{name}.tip"), place.tip, Sign::Positive));
            list.push((format!("{name}.base_angle"), place.base_angle, Sign::Any));
            list.push((format!("{name}.tip_angle"), place.tip_angle, Sign::Any));
            for (part, body) in [("barrel", &actuator.barrel), ("rod", &actuator.rod)] {
                list.push((format!("{name}.{part}.mass"), body.mass, Sign::NotNegative));
                list.push((format!("{name}.{part}.inertia"), body.inertia, Sign::NotNegative));
                list.push((format!("{name}.{part}.center"), body.center, Sign::Any));
            }
        }
        list
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Sign {
    Any,
    NotNegative,
    Positive,
}

impl Leg {
    /// The leg with these parameters, or the first one that no leg can have.
    pub fn new(parameters: LegParameters) -> Result<Self> {
        for (path, value, sign) in parameters.named() {
            let path = format!("leg.{path}");
            if !value.is_finite() {
                return Err(Error::NonFinite { path, value });
            }
            let refused = |condition| Err(Error::Domain { path: path.clone(), condition, value });
            match sign {
                Sign::Positive if value <= 0.0 => return refused("be positive"),
                Sign::NotNegative if value < 0.0 => return refused("not be negative"),
                _ => (),
            }
        }
        for (name, place) in ["hip", "knee"].into_iter().zip(&parameters.attachments) {
            if place.base == place.tip {
                let (path, condition) = (format!("leg.{name}.tip"), "differ from the base's distance");
                return Err(Error::Domain { path, condition, value: place.tip });
            }
        }
        Ok(Self { parameters })
    }

    /// Parameters of which the leg was made.
    pub fn parameters(&self) -> &LegParameters {
        &self.parameters
    }
}
