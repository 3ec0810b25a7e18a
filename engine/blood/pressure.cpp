#include "engine/blood/pressure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "physics/geometry/maths.h"

namespace blood {
namespace {

constexpr double blood_viscosity = 3.5e-3, blood_density = 1060, jet_loss = 1.52;  // [Pa s], [kg/m³], [-]
constexpr double mm3_per_ml = 1000;
constexpr double mean_of_wave = 0.325;

double fourth(double r) {
    return r * r * r * r;
}

/// Cells of one branch in the order of the flow.
using Run = std::vector<int>;

std::vector<Run> runs_of(std::span<const FlowCell> cells) {
    std::vector<Run> runs;
    std::vector<int> run_of(cells.size(), -1);
    for (int i = 0; i < static_cast<int>(cells.size()); ++i) {
        const int up = cells[static_cast<std::size_t>(i)].upstream;
        int& mine = run_of[static_cast<std::size_t>(i)];
        if (up >= 0 &&
            cells[static_cast<std::size_t>(up)].branch == cells[static_cast<std::size_t>(i)].branch &&
            runs[static_cast<std::size_t>(run_of[static_cast<std::size_t>(up)])].back() == up)
            mine = run_of[static_cast<std::size_t>(up)];
        if (mine < 0) {
            mine = static_cast<int>(runs.size());
            runs.emplace_back();
        }
        runs[static_cast<std::size_t>(mine)].push_back(i);
    }
    return runs;
}

/// Radius that each cell of a run would have without a stenosis [mm].
std::vector<double> open_radii(std::span<const FlowCell> cells, const Run& run) {
    constexpr double reach = 40;  // [mm]
    const auto widest = [&](std::size_t from, int step) {
        double most = 0, gone = 0;
        for (std::size_t k = from; k < run.size() && gone <= reach; k += static_cast<std::size_t>(step)) {
            const FlowCell& cell = cells[static_cast<std::size_t>(run[k])];
            most = std::max(most, cell.radius);
            gone += cell.length;
        }
        return most;
    };
    std::vector<double> open;
    // Before the origin is the parent, so that a stenosis there counts.
    const int parent = cells[static_cast<std::size_t>(run.front())].upstream;
    double gone = 0;
    for (std::size_t k = 0; k < run.size(); ++k) {
        double before = widest(k, -1);
        gone += cells[static_cast<std::size_t>(run[k])].length;
        if (parent >= 0 && gone <= reach)
            before = std::max(before, cells[static_cast<std::size_t>(parent)].radius);
        open.push_back(std::min(before, widest(k, 1)));
    }
    return open;
}

/// Part of a pressure [Pa] that a loss leaves, where it and the bed share what takes a flow Q without it.
double flow_left(double pressure, double flow, double laminar, double turbulent) {
    const double linear = pressure / flow + laminar;
    return 2 * pressure / (linear + std::sqrt(linear * linear + 4 * turbulent * pressure)) / flow;
}

/// A polynomial that rises from 0 to 1 with no slope at its ends; its mean is 1/2.
double smooth_step(double t) {
    return t * t * (3 - 2 * t);
}

void read_off(Beat& beat) {
    const auto [low, high] = std::ranges::minmax(beat.at);
    beat.diastolic = low;
    beat.systolic = high;
}

}  // namespace

double mean_pressure(const FlowSpec& spec) {
    return spec.diastolic + mean_of_wave * (spec.systolic - spec.diastolic);
}

double laminar_loss(double length, double r, double open) {
    return length * 8 * blood_viscosity * mm3_per_ml / std::numbers::pi * (1 / fourth(r) - 1 / fourth(open));
}

double expansion_loss(double r, double open) {
    const double area = std::numbers::pi * open * open, more = open * open / (r * r) - 1;
    return jet_loss * blood_density / 2 * more * more / (area * area);
}

std::vector<Lesion> lesions_of(std::span<const FlowCell> cells) {
    constexpr double begins = 0.98, counts = 0.8;  // of the open radius [-]
    std::vector<Lesion> found;
    for (const Run& run : runs_of(cells)) {
        const std::vector<double> open = open_radii(cells, run);
        const auto part = [&](std::size_t k) {
            return cells[static_cast<std::size_t>(run[k])].radius / open[k];
        };
        for (std::size_t k = 0; k < run.size(); ++k) {
            if (part(k) >= begins) continue;
            Lesion lesion;
            double narrowest = 1;
            for (; k < run.size() && part(k) < begins; ++k) {
                const FlowCell& cell = cells[static_cast<std::size_t>(run[k])];
                if (part(k) < narrowest) {
                    narrowest = part(k);
                    lesion.throat = lesion.cells.size();
                }
                lesion.cells.push_back(run[k]);
                lesion.laminar.push_back(laminar_loss(cell.length, cell.radius, open[k]));
                lesion.turbulent = std::max(lesion.turbulent, expansion_loss(cell.radius, open[k]));
            }
            if (narrowest <= counts) found.push_back(std::move(lesion));
        }
    }
    std::ranges::sort(found, {}, [](const Lesion& lesion) { return lesion.cells.front(); });
    return found;
}

double mean_pressure_in(const BloodFlow& flow, int cell) {
    const auto in = static_cast<std::size_t>(cell);
    if (flow.tree[in] >= static_cast<int>(flow.sources.size()))
        return std::min(collateral_pressure, flow.mean_pressure);
    const auto obstructed = [&](std::size_t i) {
        return flow.pressure_left.empty() ? 1.0 : flow.pressure_left[i];
    };
    double left = 1;  // of the pressure, and of the flow, by the lesions passed
    if (!flow.lesions.empty()) {
        std::vector<char> passed(flow.cells.size(), 0);
        for (int i = cell; i >= 0; i = flow.cells[static_cast<std::size_t>(i)].upstream)
            passed[static_cast<std::size_t>(i)] = 1;
        std::vector<double> resting;
        for (const Lesion& lesion : flow.lesions) {
            if (!passed[static_cast<std::size_t>(lesion.cells.front())]) continue;
            if (resting.empty()) resting = flow.resting();
            double whole = 0, laminar = 0;
            for (std::size_t k = 0; k < lesion.cells.size(); ++k) {
                whole += lesion.laminar[k];
                if (passed[static_cast<std::size_t>(lesion.cells[k])]) laminar += lesion.laminar[k];
            }
            const double pressure = pascal_per_mmhg * flow.mean_pressure * left *
                                    obstructed(static_cast<std::size_t>(lesion.cells.front()));
            const double through = resting[static_cast<std::size_t>(lesion.cells[lesion.throat])] * left;
            if (!(through > 1e-9)) continue;
            const double q = through * flow_left(pressure, through, whole, lesion.turbulent);
            const bool behind = lesion.throat + 1 < lesion.cells.size()
                                    ? passed[static_cast<std::size_t>(lesion.cells[lesion.throat + 1])] != 0
                                    : passed[static_cast<std::size_t>(lesion.cells[lesion.throat])] != 0;
            left *= 1 - (laminar * q + (behind ? lesion.turbulent * q * q : 0.0)) / pressure;
        }
    }
    return flow.mean_pressure * left * obstructed(in);
}

Across across(const BloodFlow& flow, int branch, const geometry::Vec3& from, const geometry::Vec3& middle,
              const geometry::Vec3& to) {
    Across found;
    found.middle = found.before = found.behind = flow.nearest_in(branch, middle);
    if (found.middle < 0) return found;
    const auto upstream = [&](int cell) { return flow.cells[static_cast<std::size_t>(cell)].upstream; };
    const double half = std::max((from - middle).norm(), (to - middle).norm());
    double passed = 0;
    while (passed < half && upstream(found.before) >= 0) {
        passed += flow.cells[static_cast<std::size_t>(found.before)].distance;
        found.before = upstream(found.before);
    }
    // Blood may run from the branch's end to its origin.
    for (const geometry::Vec3& end : {from, to}) {
        const int cell = flow.nearest_in(branch, end);
        int up = cell;
        while (up >= 0 && up != found.middle) up = upstream(up);
        if (up == found.middle && cell != found.middle) found.behind = cell;
    }
    return found;
}

double ratio_across(double pressure, double flow, const Obstruction& in_the_way, double more) {
    if (!(flow > 1e-9) || !(pressure > 0)) return 1;
    return in_the_way.passes *
           flow_left(pascal_per_mmhg * pressure, more * flow, in_the_way.laminar, in_the_way.turbulent);
}

double heart_phase(double time, double heart_rate) {
    const double beats = time * heart_rate / 60.0;
    return beats - std::floor(beats);
}

double pressure_wave(double phase) {
    // Of the beat: to the highest, to the notch, to the lift behind it, to the next beat.
    constexpr double begins = 0.27, rise = 0.25, fall = 0.16, lift = 0.05, run_off = 0.54;
    // The notch has the height with which the wave's mean is mean_of_wave: its pieces have the means 1/2 of
    // their ends' sum, and 2/5 of where the last begins.
    constexpr double lifted = 0.36;
    constexpr double notch =
        (mean_of_wave - 0.5 * rise - 0.5 * fall - lifted * (0.5 * lift + 0.4 * run_off)) /
        (0.5 * fall + 0.5 * lift);
    static_assert(notch > 0.2 && notch < lifted);
    double u = phase - begins;
    u -= std::floor(u);
    if (u < rise) return smooth_step(u / rise);
    u -= rise;
    if (u < fall) return 1 - (1 - notch) * smooth_step(u / fall);
    u -= fall;
    if (u < lift) return notch + (lifted - notch) * smooth_step(u / lift);
    const double t = std::min(1.0, (u - lift) / run_off), rest = 1 - t;
    return lifted * rest * rest * rest * (1 + 3 * t);
}

double Beat::pressure(double phase) const {
    const double place = (phase - std::floor(phase)) * samples;
    const int before = static_cast<int>(place) % samples;
    const double part = place - std::floor(place);
    return (1 - part) * at[static_cast<std::size_t>(before)] +
           part * at[static_cast<std::size_t>((before + 1) % samples)];
}

Beat beat_of(const FlowSpec& spec, double mean) {
    Beat beat;
    const double part = mean / mean_pressure(spec);
    for (std::size_t k = 0; k < beat.at.size(); ++k)
        beat.at[k] = part * (spec.diastolic + (spec.systolic - spec.diastolic) *
                                                  pressure_wave(static_cast<double>(k) / Beat::samples));
    beat.mean = mean;
    read_off(beat);
    return beat;
}

double gap_resistance(double vessel, double device) {
    constexpr double sealed = 0.98, length = 10;  // [-], [mm]
    if (!(device < sealed * vessel)) return std::numeric_limits<double>::infinity();
    if (!(device > 0)) return 0;
    const double square = vessel * vessel - device * device;
    const double conductance =
        fourth(vessel) - fourth(device) - square * square / geometry::log(vessel / device);
    return 8 * blood_viscosity * length * mm3_per_ml / (std::numbers::pi * conductance);
}

Beat wedged(const Beat& free, double flow, double gap) {
    if (!(flow > 1e-9)) return free;
    const double bed = free.mean * pascal_per_mmhg / flow;
    const double left = std::isinf(gap) ? 0.0 : bed / (bed + gap);
    const double collateral = std::min(collateral_pressure, free.mean);
    Beat beat = free;
    for (double& p : beat.at) p = collateral + left * (p - collateral);
    beat.mean = collateral + left * (free.mean - collateral);
    read_off(beat);
    return beat;
}

Beat damped(const Beat& given, double resistance, double heart_rate) {
    const double tau = resistance * line_compliance, period = 60 / heart_rate, step = period / Beat::samples;
    if (!(tau > 1e-6 * step)) return given;
    Beat beat = given;
    if (tau > 1e3 * period) {
        beat.at.fill(given.mean);
        read_off(beat);
        return beat;
    }
    // Exact for an input that is linear between samples.
    const double kept = geometry::exp(-step / tau);
    const auto next = [&](double y, double x, double after) {
        const double slope = (after - x) / step;
        return x + slope * (step - tau) + kept * (y - x + slope * tau);
    };
    const std::size_t count = beat.at.size();
    double y = 0;
    for (std::size_t k = 0; k < count; ++k) y = next(y, given.at[k], given.at[(k + 1) % count]);
    y /= 1 - geometry::exp(-period / tau);  // comes back to where it was
    for (std::size_t k = 0; k < count; ++k) {
        beat.at[k] = y;
        y = next(y, given.at[k], given.at[(k + 1) % count]);
    }
    read_off(beat);
    return beat;
}

double ecg(double phase, double heart_rate) {
    constexpr double before_pressure = 0.08, rises = 0.27;  // [s], phase
    struct Wave {
        double angle, height, width;
    };
    constexpr double pi = std::numbers::pi;
    constexpr Wave waves[] = {
        {-pi / 3, 1.2, 0.25}, {-pi / 12, -5, 0.1}, {0, 30, 0.1}, {pi / 12, -7.5, 0.1}, {pi / 2, 0.75, 0.4}};
    constexpr double of_r = 30 * 0.1 * 0.1;
    const double at = phase - rises + before_pressure * heart_rate / 60;
    double sum = 0;
    for (const Wave& wave : waves) {
        const double turns = at - wave.angle / (2 * pi);
        const double angle = 2 * pi * (turns - std::round(turns));
        // The solution of their equation of motion without its return to the baseline.
        sum += wave.height * wave.width * wave.width / of_r *
               geometry::exp(-angle * angle / (2 * wave.width * wave.width));
    }
    return sum;
}

}  // namespace blood
