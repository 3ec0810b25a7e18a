#pragma once
/// Blood pressure: over a heartbeat, along the vessels, and as a catheter's end and bore pass it on. With the
/// electrocardiogram of the same beats. All is a function of the flow, a place and the time: no state.
///
/// Along the vessels. As in BloodFlow, vessels resist no flow, and every bed behind them is a resistance R
/// that took all of the mean pressure p̄ of the aorta. So pressure falls only
///  - at an Obstruction, to the part that drives what is left of the flow through R:
///  BloodFlow::pressure_left;
///  - along a Lesion, a stenosis of the vessels as they are. BloodFlow divides the flow as if it were not
///  there;
///    its pressure is that of the flow q [ml/s] which it and the bed would share,
///        p = R q + a q + b q²,  R = p / Q,   with p and Q before it,   and behind it is R q [Pa].
/// Both resist as Young and Tsai (J Biomech 1973;6:395) write it, without their term of inertia:
///    Δp = a q + b q²
///    a = Σ 8 μ l / π (1/r⁴ − 1/r₀⁴)          Poiseuille along it, beyond the open vessel
///    b = 1.52 ρ/2 (A₀/A₁ − 1)² / A₀²          of the jet behind the throat A₁
/// with μ = 3.5 mPa s and ρ = 1060 kg/m³. The pulse keeps its part of the mean: exact for a laminar loss
/// before a bed that is a resistance; jets and elastic arteries behind them damp it more. The wave's way
/// along the arteries, in time and in form, is left out.

#include <array>
#include <span>
#include <vector>

#include "engine/blood/blood_flow.h"

namespace blood {

inline constexpr double pascal_per_mmhg = 133.322;

/// Loss along `length` of a lumen of radius r in a vessel of radius r₀ [mm]: a above [Pa s/ml].
double laminar_loss(double length, double r, double open);
/// Of the jet behind it: b above [Pa s²/ml²].
double expansion_loss(double r, double open);

/// Stenoses along the branches: stretches with the vessel wider on both sides, within 40 mm, whose throat has
/// lost a fifth of the diameter or more. The open radius r₀ is the narrower of the widest before and the
/// widest behind, so that a vessel that tapers, or a branch of a wider one, has none.
std::vector<Lesion> lesions_of(std::span<const FlowCell>);

/// Mean pressure in a cell [mmHg]. Beyond a plug it is collateral_pressure.
double mean_pressure_in(const BloodFlow&, int cell);

/// Cells before, in and behind a stretch of a branch, along the flow; -1 in a branch without any.
struct Across {
    int before = -1, middle = -1, behind = -1;
    bool known() const { return middle >= 0; }
};
Across across(const BloodFlow&, int branch, const geometry::Vec3& from, const geometry::Vec3& middle,
              const geometry::Vec3& to);

/// Part of a pressure [mmHg] that is left behind an obstruction, where the bed lets a flow [ml/s] through
/// under that pressure without it. `more`: how many times as much as at rest the bed lets through, whose
/// resistance is as much lower.
double ratio_across(double pressure, double flow, const Obstruction&, double more = 1);

/// Of the flow in hyperaemia to that at rest (estimate: reserves of coronary beds are 2.5 to 5 in texts); the
/// pressure of the arteries stays.
inline constexpr double hyperaemia = 3;

/// Mean pressure of blood that comes by collateral arteries alone, which is also what a catheter that seals
/// its vessel shows: of the order of coronary wedge pressures (estimate) [mmHg].
inline constexpr double collateral_pressure = 25;

/// Where a moment is in the heart's cycle, from 0 to 1; the flow of ContrastFlow is highest at 0.5.
double heart_phase(double time, double heart_rate);

/// Pressure in the aorta at a phase, 0 in diastole to 1 at its highest, with mean 0.325: it rises in a
/// quarter of the beat from phase 0.27, falls to the notch of the aortic valve, whose closure lifts it a
/// little, and runs off. The form is an estimate by textbook curves.
double pressure_wave(double phase);

/// One beat at equal phases, and what a monitor shows of it.
struct Beat {
    static constexpr int samples = 200;
    std::array<double, samples> at = {};  // [mmHg]
    double systolic = 0, diastolic = 0, mean = 0;

    double pressure(double phase) const;  // in between linear
};
/// In vessels with this mean pressure [mmHg].
Beat beat_of(const FlowSpec&, double mean);

/// A device of radius r [mm] in a vessel of radius R resists the flow past its last 10 mm (estimate) as an
/// annulus does: 8 μ l / (π (R⁴ − r⁴ − (R² − r²)² / ln(R/r))); infinity from r = 0.98 R on, where it seals
/// the vessel [Pa s/ml].
double gap_resistance(double vessel, double device);
/// At an end hole behind which a vessel has a flow Q [ml/s] without the device: of p − p_c, with p_c the
/// collateral pressure, or p where that is lower, remains R / (R + gap), R = (mean p) / Q. The mean wedges
/// toward p_c, the pulse falls. Vessels without flow keep their pressure.
Beat wedged(const Beat&, double flow, double gap);

/// Of a line from hub to transducer, with its stopcocks: 1 mm³ per 100 mmHg (estimate: the diaphragm alone
/// has some 0.03, Webster, Medical Instrumentation) [ml/Pa].
inline constexpr double line_compliance = 1e-3 / (100 * pascal_per_mmhg);
/// What a transducer shows behind a bore of that resistance [Pa s/ml]: a low pass of first order, τ dy/dt =
/// x − y with τ = resistance × line_compliance, where it has come to be periodic. A long narrow bore, or a
/// wire in it, damps the pulse and keeps the mean. Inertia, by which wide lines overshoot, is left out.
Beat damped(const Beat&, double resistance, double heart_rate);

/// Lead II [mV]: a sum of Gaussians of the phase for P, Q, R, S and T, with the angles, heights and widths of
/// McSharry et al. (IEEE Trans Biomed Eng 2003;50:289), R of 1 mV. R is 0.08 s before the aorta's pressure
/// rises (estimate).
double ecg(double phase, double heart_rate);

}  // namespace blood
