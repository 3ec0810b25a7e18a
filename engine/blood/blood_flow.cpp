#include "engine/blood/blood_flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <limits>
#include <numbers>
#include <numeric>

#include "engine/anatomy/organs.h"
#include "engine/blood/pressure.h"
#include "engine/io/error.h"
#include "physics/geometry/maths.h"
#include "physics/geometry/polyline.h"

namespace blood {

using geometry::CentrelineBranch;
using geometry::Vec3;
namespace {

constexpr double smallest_radius = 0.15;       // [mm]
constexpr double radii_long = 10;              // a generation
constexpr double cubic_mm = 1000;              // of a ml
constexpr double longest = 6, shortest = 0.2;  // [s]

constexpr double cubic_mm_per_ml = 1000.0;
constexpr double tissue_density = 1.05;  // [g/ml]

/// What the tissue behind an end takes. `demand`: flow at rest per radius cubed relative to an arm's, chosen
/// so that the generated vessels come near published flows: common femoral artery 350 ± 141 ml/min
/// (Ultrasound Med Biol 1986;12:777), infrarenal aorta 17.5 ± 5.4 ml/s (Les 2010), both kidneys 1.1 l/min, an
/// internal carotid 250 ml/min (textbook values). The demands of gut, heart and trunk, and all perfusions and
/// transit times of blood through the small vessels where contrast blushes and through the veins, are
/// estimates of textbook order.
struct Supply {
    anatomy::Organ organ;
    double demand;     // [-]
    double perfusion;  // [ml/min per 100 g]
    double transit;    // [s]
    double venous;     // through the veins in the field [s]
};
constexpr std::array<Supply, 7> supplies = {{
    {anatomy::Organ::Arm, 1.0, 3.0, 15.0, 5.0},
    {anatomy::Organ::Leg, 0.5, 3.0, 15.0, 6.0},
    {anatomy::Organ::Kidney, 4.0, 350.0, 5.0, 2.0},
    {anatomy::Organ::Brain, 3.0, 55.0, 4.0, 4.0},
    {anatomy::Organ::Gut, 1.8, 60.0, 6.0, 4.0},
    {anatomy::Organ::Heart, 10.0, 80.0, 4.0, 3.0},
    {anatomy::Organ::Trunk, 0.4, 10.0, 10.0, 4.0},
}};

/// A kidney: the medulla gets a tenth of the blood; 0.2 of the plasma, and of contrast with it, is filtered
/// (texts). Medullary blood: a fifth of 30 % of the tissue, at a tenth of 3.5 ml/min/g, stays for 10 s. The
/// times of the tubules are estimates by the phases of a CT: medulla as bright as cortex after 80 to 100 s,
/// contrast in the pelvis after 2 to 3 min (texts).
constexpr Inner kidney{0.1, 10.0, 0.2, 70.0, 25.0};

const Supply& supply_behind(const anatomy::Anatomy& anatomy, int branch) {
    const anatomy::Organ organ = anatomy::organ_behind(anatomy, branch);
    return *std::ranges::find(supplies, organ, &Supply::organ);
}

double square(double x) {
    return x * x;
}

/// Places and radii along a branch by arc length.
struct BranchArc {
    const CentrelineBranch* branch;
    std::vector<double> lengths;  // to each sample [mm]

    explicit BranchArc(const CentrelineBranch& given)
        : branch(&given), lengths(geometry::arc_lengths(given.points)) {}
    std::pair<int, double> at(double s) const {  // sample before s, and the part of the step to the next [-]
        const auto after = std::upper_bound(lengths.begin() + 1, lengths.end() - 1, s);
        const int i = static_cast<int>(after - lengths.begin()) - 1;
        const double step = lengths[i + 1] - lengths[i];
        return {i, step > 0 ? std::clamp((s - lengths[i]) / step, 0.0, 1.0) : 0.0};
    }
    Vec3 point(double s) const {
        const auto [i, t] = at(s);
        return (1 - t) * branch->points[i] + t * branch->points[i + 1];
    }
    double radius(double s) const {
        const auto [i, t] = at(s);
        return (1 - t) * branch->radii[i] + t * branch->radii[i + 1];
    }
};

/// Arc length at which the cells of a branch begin [mm].
double exit_of(const anatomy::Anatomy& anatomy, int b, const BranchArc& arc, double spacing) {
    return std::min(anatomy::origin_of(anatomy, b), std::max(0.0, arc.lengths.back() - spacing));
}

int deepest(const std::vector<FlowCell>& cells, int first, int past, const Vec3& x) {
    int best = first;
    double least = std::numeric_limits<double>::infinity();
    for (int i = first; i < past; ++i) {
        const double power = (x - cells[i].centre).squaredNorm() - square(cells[i].radius);
        if (power < least) least = power, best = i;
    }
    return best;
}

/// Cells of all branches and their neighbours, before the direction of flow is known.
struct Undirected {
    std::vector<FlowCell> cells;
    std::vector<std::vector<int>> neighbours;
    std::vector<int> first;  // first cell of each branch, plus one entry at the end

    void join(int a, int b) {
        neighbours[a].push_back(b);
        neighbours[b].push_back(a);
    }
};

Undirected cut(const anatomy::Anatomy& anatomy, double spacing) {
    Undirected made;
    for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
        const BranchArc arc(anatomy.branches[b]);
        const double start = exit_of(anatomy, b, arc, spacing), whole = arc.lengths.back() - start;
        const int count = std::max(1, static_cast<int>(std::lround(whole / spacing)));
        const double length = whole / count;
        const int first = static_cast<int>(made.cells.size());
        made.first.push_back(first);
        for (int k = 0; k < count; ++k) {
            const double from = start + k * length, middle = from + 0.5 * length;
            FlowCell cell{arc.point(middle), arc.radius(middle), length, 0, b, -1, 0};
            cell.volume =
                std::numbers::pi * length / cubic_mm_per_ml *
                (square(arc.radius(from)) + 4 * square(cell.radius) + square(arc.radius(from + length))) / 6;
            made.cells.push_back(cell);
            made.neighbours.emplace_back();
            if (k > 0) made.join(first + k - 1, first + k);
        }
        const int parent = anatomy.branches[b].parent;
        if (parent >= 0) {
            made.join(
                deepest(made.cells, made.first[parent], made.first[parent + 1], made.cells[first].centre),
                first);
        }
    }
    made.first.push_back(static_cast<int>(made.cells.size()));
    return made;
}

/// Cell of the centreline's end nearest to an opening.
int cell_at(const anatomy::Anatomy& anatomy, const Undirected& vessels, const geometry::OpenEnd& opening) {
    int best = 0;
    double least = std::numeric_limits<double>::infinity();
    const auto offer = [&](const Vec3& place, int cell) {
        const double distance = (place - opening.centre).norm();
        if (distance < least) least = distance, best = cell;
    };
    for (std::size_t b = 0; b < anatomy.branches.size(); ++b) {
        const CentrelineBranch& branch = anatomy.branches[b];
        if (branch.parent < 0) offer(branch.points.front(), vessels.first[b]);
        offer(branch.points.back(), vessels.first[b + 1] - 1);
    }
    return best;
}

/// Lists the cells connected to `start`, upstream before downstream.
std::vector<std::pair<int, int>> walk(const Undirected& vessels, int start) {
    std::vector<std::pair<int, int>> order{{start, -1}};  // cell, position of the one upstream
    for (std::size_t next = 0; next < order.size(); ++next) {
        const auto [cell, upstream] = order[next];
        for (const int other : vessels.neighbours[cell]) {
            if (upstream < 0 || other != order[upstream].first)
                order.emplace_back(other, static_cast<int>(next));
        }
    }
    return order;
}

}  // namespace

double arterial_time(double radius, double flow) {
    if (!(flow > 1e-6)) return 0;
    const double velocity = cubic_mm * flow / (std::numbers::pi * radius * radius);
    const double generations = 3 * geometry::log(std::max(2.0, radius / smallest_radius)) / std::numbers::ln2;
    return std::clamp(generations * radii_long * radius / velocity, shortest, longest);
}

DistalArteries::DistalArteries(std::span<const Outlet> outlets, double Outlet::*time) {
    for (const Outlet& outlet : outlets) volume_.push_back(outlet.flow * outlet.*time / bins);
    reset();
}

void DistalArteries::reset() {
    mass_.assign(volume_.size() * bins, 0.0);
    shown_.assign(mass_.size(), 0.0f);
}

double DistalArteries::pass(int outlet, double entering, double flow, double dt) {
    if (!(volume_[outlet] > 0)) return entering;
    const double passed = std::max(0.0, flow) * dt / volume_[outlet];  // bins passed
    if (passed == 0) {
        mass_[outlet * bins] += entering;
        return 0;
    }
    double* mass = mass_.data() + static_cast<std::ptrdiff_t>(outlet) * bins;
    const int whole = static_cast<int>(std::min(passed, 1.0 * bins));
    const double part = std::min(passed, 1.0 * bins) - whole;
    std::array<double, bins> moved{};
    double left = 0;
    const auto put = [&](int bin, double amount) {
        if (bin < bins)
            moved[bin] += amount;
        else
            left += amount;
    };
    for (int k = 0; k < bins; ++k) {
        put(k + whole, (1 - part) * mass[k]);
        put(k + whole + 1, part * mass[k]);
    }
    for (int k = 0; k < whole; ++k) put(k, entering / passed);
    put(whole, entering * std::max(0.0, 1 - whole / passed));
    std::copy(moved.begin(), moved.end(), mass);
    return left;
}

void DistalArteries::show() {
    for (std::size_t i = 0; i < mass_.size(); ++i) {
        const double volume = volume_[i / bins];
        shown_[i] = volume > 0 ? static_cast<float>(mass_[i] / volume) : 0.0f;
    }
}

double DistalArteries::held(int outlet) const {
    const auto first = mass_.begin() + static_cast<std::ptrdiff_t>(outlet) * bins;
    return std::accumulate(first, first + bins, 0.0);
}

double usual_flow(double radius) {
    constexpr double wide = 16.0, narrow = 2.35, through_wide = 84.0, through_narrow = 4.1;
    static const double power = geometry::log(through_wide / through_narrow) / geometry::log(wide / narrow);
    return through_wide * geometry::pow(radius / wide, power);
}

std::vector<std::string> problems(const FlowSpec& spec) {
    std::vector<std::string> found;
    const auto require = [&found](bool holds, const char* sentence) {
        if (!holds) found.emplace_back(sentence);
    };
    // Each comparison is written so that NaN fails it.
    require(!spec.inflow || (*spec.inflow >= 0 && *spec.inflow <= 500),
            "the blood's inflow must lie within 0 and 500 ml/s");
    require(spec.exponent >= 0 && spec.exponent <= 6, "the exponent of the flow must lie within 0 and 6");
    require(spec.heart_rate >= 20 && spec.heart_rate <= 250,
            "the heart rate must lie within 20 and 250 per minute");
    require(spec.pulsatility >= 0 && spec.pulsatility <= 1, "the pulsatility must lie within 0 and 1");
    require(spec.dispersion >= 0 && spec.dispersion <= 100, "the dispersion must lie within 0 and 100");
    require(spec.limit >= 0 && std::isfinite(spec.limit), "the limit of contrast must be 0 ml or more");
    require(spec.systolic >= 50 && spec.systolic <= 300,
            "the systolic pressure must lie within 50 and 300 mmHg");
    require(spec.diastolic >= 20 && spec.diastolic <= 200,
            "the diastolic pressure must lie within 20 and 200 mmHg");
    require(spec.systolic >= spec.diastolic + 5,
            "the systolic pressure must be higher than the diastolic one by 5 mmHg or more");
    return found;
}

BloodFlow blood_flow(const anatomy::Anatomy& anatomy, const FlowSpec& spec, double spacing) {
    const std::vector<std::string> wrong = problems(spec);
    if (!wrong.empty()) throw io::InputError("{}", fmt::join(wrong, "\n"));
    if (!spec.source.empty() && !anatomy::find_end(anatomy, spec.source)) {
        std::vector<std::string> names;
        for (const anatomy::VesselEnd& end : anatomy.ends) names.push_back(end.opening.name);
        throw io::InputError("blood cannot come from '{}': no such end; ends are {}", spec.source,
                             fmt::join(names, ", "));
    }
    const Undirected vessels = cut(anatomy, spacing);
    std::vector<int> at_end, by_width;
    for (int e = 0; e < static_cast<int>(anatomy.ends.size()); ++e) {
        at_end.push_back(cell_at(anatomy, vessels, anatomy.ends[e].opening));
        by_width.push_back(e);
    }
    std::ranges::stable_sort(by_width, [&](int a, int b) {
        const geometry::OpenEnd &p = anatomy.ends[a].opening, &q = anatomy.ends[b].opening;
        if ((p.name == spec.source) != (q.name == spec.source)) return p.name == spec.source;
        return p.radius > q.radius;
    });

    BloodFlow flow;
    std::vector<int> position(vessels.cells.size(), -1);  // in flow.cells
    const auto add_tree = [&](int start, double inflow) {
        const int first = static_cast<int>(flow.cells.size());
        for (const auto& [cell, upstream] : walk(vessels, start)) {
            position[cell] = static_cast<int>(flow.cells.size());
            flow.cells.push_back(vessels.cells[cell]);
            flow.tree.push_back(static_cast<int>(flow.sources.size()));
            if (upstream < 0) continue;
            FlowCell& added = flow.cells.back();
            added.upstream = first + upstream;
            const FlowCell& before = flow.cells[added.upstream];
            added.distance =
                std::max((added.centre - before.centre).norm(), 0.5 * std::min(added.length, before.length));
        }
        flow.sources.push_back({first, inflow});
    };
    std::vector<bool> is_source(anatomy.ends.size(), false);
    for (const int e : by_width) {
        if (position[at_end[e]] >= 0) continue;
        is_source[e] = true;
        add_tree(at_end[e], spec.inflow.value_or(usual_flow(anatomy.ends[e].opening.radius)));
    }
    // The blood of a tree without an end does not move.
    for (int i = 0; i < static_cast<int>(vessels.cells.size()); ++i)
        if (position[i] < 0) add_tree(i, 0);

    std::vector<double> demand(flow.sources.size(), 0.0);
    for (std::size_t e = 0; e < anatomy.ends.size(); ++e) {
        if (is_source[e]) continue;
        const geometry::OpenEnd& opening = anatomy.ends[e].opening;
        const int cell = position[at_end[e]], branch = flow.cells[cell].branch;
        const Supply& supply = supply_behind(anatomy, branch);
        Outlet outlet;
        outlet.end = opening.name;
        outlet.branch = anatomy.branches[branch].name;
        outlet.organ = anatomy::name_of(supply.organ);
        outlet.cell = cell;
        outlet.place = opening.centre;
        outlet.direction = opening.outward_normal;
        outlet.fraction = supply.demand * geometry::pow(opening.radius, spec.exponent);
        outlet.transit = supply.transit;
        outlet.venous = supply.venous;
        if (supply.organ == anatomy::Organ::Kidney) outlet.inner = kidney;
        outlet.radius = opening.radius;
        outlet.tissue = 100.0 / supply.perfusion * 60.0 / tissue_density;  // of 1 ml/s
        demand[flow.tree[cell]] += outlet.fraction;
        flow.outlets.push_back(std::move(outlet));
    }
    // A root that ends in another tree, as a vertebral artery in the basilar artery, feeds that by its width.
    for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
        const CentrelineBranch& branch = anatomy.branches[b];
        const std::optional<anatomy::VesselPlace> joint = anatomy::joint_of(anatomy, b);
        if (branch.parent >= 0 || !joint) continue;
        Outlet outlet;
        outlet.cell = position[vessels.first[b + 1] - 1];
        outlet.into = position[deepest(vessels.cells, vessels.first[joint->branch],
                                       vessels.first[joint->branch + 1], branch.points.back())];
        const int tree = flow.tree[outlet.cell], other = flow.tree[outlet.into];
        if (other == tree || demand[other] == 0) continue;
        outlet.end = outlet.branch = branch.name;
        outlet.organ = "confluence";
        outlet.place = branch.points.back();
        outlet.direction = (outlet.place - branch.points[branch.points.size() - 2]).normalized();
        outlet.fraction =
            supply_behind(anatomy, b).demand * geometry::pow(branch.radii.back(), spec.exponent);
        outlet.transit = outlet.tissue = 1;
        demand[tree] += outlet.fraction;
        flow.outlets.push_back(std::move(outlet));
    }
    std::vector<double> inflow;  // of each tree, with what other trees bring [ml/s]
    for (const BloodFlow::Source& source : flow.sources) inflow.push_back(source.inflow);
    for (Outlet& outlet : flow.outlets) {
        outlet.fraction /= demand[flow.tree[outlet.cell]];
        if (outlet.into >= 0)
            inflow[flow.tree[outlet.into]] += outlet.fraction * inflow[flow.tree[outlet.cell]];
    }
    for (Outlet& outlet : flow.outlets) {
        outlet.flow = outlet.fraction * inflow[flow.tree[outlet.cell]];
        if (outlet.into < 0) outlet.arterial = arterial_time(outlet.radius, outlet.flow);
        outlet.tissue *= std::max(outlet.flow, 1e-3);
    }
    flow.mean_pressure = mean_pressure(spec);
    flow.lesions = lesions_of(flow.cells);
    return flow;
}

namespace {

/// Part of a flow Q₀ [ml/s] that is left of it where an obstruction resists besides the bed, which takes all
/// of the arteries' mean pressure [Pa] at rest.
double left_by(const Obstruction& in_the_way, double flow, double pressure) {
    if (!(flow > 1e-9)) return in_the_way.passes;
    const double linear = pressure / flow + in_the_way.laminar, square = in_the_way.turbulent;
    // P = linear Q + square Q², without cancellation.
    const double left = 2 * pressure / (linear + std::sqrt(linear * linear + 4 * square * pressure));
    return in_the_way.passes * left / flow;
}

/// Nothing comes by the plug before `first`: what lies beyond is a tree of its own, without a source.
void cut_off_beyond(BloodFlow& flow, int first, const std::vector<char>& beyond) {
    const int from = flow.tree[first], to = static_cast<int>(flow.sources.size()) + flow.cut_off++;
    double all = 0;
    const auto cut = [&](const Outlet& outlet) {
        return beyond[outlet.cell] && flow.tree[outlet.cell] == from;
    };
    for (const Outlet& outlet : flow.outlets) all += cut(outlet) ? outlet.fraction : 0;
    for (Outlet& outlet : flow.outlets)
        if (cut(outlet) && all > 0) outlet.fraction /= all;
    for (std::size_t i = 0; i < beyond.size(); ++i)
        if (beyond[i] && flow.tree[i] == from) flow.tree[i] = to;
}

/// What the fractions make of the sources' inflow.
void renew_flows(BloodFlow& flow) {
    std::vector<double> inflow(flow.sources.size() + static_cast<std::size_t>(flow.cut_off));
    for (std::size_t s = 0; s < flow.sources.size(); ++s) inflow[s] = flow.sources[s].inflow;
    for (const Outlet& outlet : flow.outlets)
        if (outlet.into >= 0)
            inflow[flow.tree[outlet.into]] += outlet.fraction * inflow[flow.tree[outlet.cell]];
    for (Outlet& outlet : flow.outlets) outlet.flow = outlet.fraction * inflow[flow.tree[outlet.cell]];
}

}  // namespace

BloodFlow BloodFlow::obstructed(std::span<const Obstruction> all) const {
    BloodFlow flow = *this;
    flow.pressure_left.assign(cells.size(), 1.0);
    for (const Obstruction& in_the_way : all) {
        const bool plug = in_the_way.passes == 0;
        const int first = flow.nearest_in(in_the_way.branch, plug ? in_the_way.from : in_the_way.middle);
        if (first < 0) continue;
        std::vector<char> beyond(cells.size(), 0);
        double through = 0;
        for (std::size_t i = 0; i < cells.size(); ++i)
            beyond[i] = static_cast<int>(i) == first || (cells[i].upstream >= 0 && beyond[cells[i].upstream]);
        if (plug) {
            cut_off_beyond(flow, first, beyond);
            continue;
        }
        for (const Outlet& outlet : outlets) through += beyond[outlet.cell] ? outlet.flow : 0;
        const double left = left_by(in_the_way, through, mean_pressure * pascal_per_mmhg);
        // What drives the rest of the flow through the bed, which resists as before.
        for (std::size_t i = 0; i < cells.size() && through > 1e-9; ++i)
            if (beyond[i]) flow.pressure_left[i] *= left;
        for (Outlet& outlet : flow.outlets)
            if (beyond[outlet.cell]) outlet.fraction *= left;
    }
    renew_flows(flow);
    return flow;
}

int BloodFlow::entry_of(int branch) const {
    int first = -1;
    for (int i = 0; i < static_cast<int>(cells.size()) && first < 0; ++i)
        if (cells[i].branch == branch) first = i;
    if (first < 0) return -1;
    double passed = 0;
    int at = first;
    for (int i = first + 1; i < static_cast<int>(cells.size()) && passed < cells[first].radius; ++i) {
        if (cells[i].branch != branch || cells[i].upstream != at) continue;
        passed += cells[i].distance;
        at = i;
    }
    return at;
}

int BloodFlow::nearest_in(int branch, const Vec3& place) const {
    int best = -1;
    for (int i = 0; i < static_cast<int>(cells.size()); ++i)
        if (cells[i].branch == branch && (best < 0 || (cells[i].centre - place).squaredNorm() <
                                                          (cells[best].centre - place).squaredNorm()))
            best = i;
    return best;
}

int BloodFlow::nearest(const Vec3& x) const {
    return deepest(cells, 0, static_cast<int>(cells.size()), x);
}

std::vector<double> BloodFlow::resting() const {
    std::vector<double> into(cells.size()), leaving(outlets.size());
    balance(1.0, std::vector<double>(cells.size(), 0.0), into, leaving);
    return into;
}

void BloodFlow::balance(double pulse, std::span<const double> added, std::span<double> into,
                        std::span<double> leaving) const {
    std::vector<double> entering(sources.size() + static_cast<std::size_t>(cut_off));
    for (std::size_t s = 0; s < sources.size(); ++s) entering[s] = pulse * sources[s].inflow;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        entering[tree[i]] += added[i];
        into[i] = -added[i];
    }
    for (const Outlet& outlet : outlets) {
        if (outlet.into < 0) continue;
        const double passed = outlet.fraction * entering[tree[outlet.cell]];
        entering[tree[outlet.into]] += passed;
        into[outlet.into] -= passed;
    }
    for (std::size_t o = 0; o < outlets.size(); ++o) {
        leaving[o] = outlets[o].fraction * entering[tree[outlets[o].cell]];
        into[outlets[o].cell] += leaving[o];
    }
    for (std::size_t i = cells.size(); i-- > 0;)
        if (cells[i].upstream >= 0) into[cells[i].upstream] += into[i];
}

}  // namespace blood
