#include "engine/blood/contrast_flow.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numbers>
#include <utility>

#include "engine/io/error.h"
#include "engine/io/text.h"
#include "physics/geometry/maths.h"
#include "render/xray/materials.h"

namespace blood {

namespace {

/// Largest part of a cell's volume that may leave it in one substep.
constexpr double courant = 0.8;
/// Flow is constant and dispersion is applied once over at most this time, so that neither the pulse nor a
/// bolus's shape depends on the frame rate [s].
constexpr double longest_part = 1.0 / 60;
/// Of the flow that a vessel had before a plug: what the pulse moves to and fro in it (estimate) [-].
constexpr double stirring = 0.2;
/// Less than this counts as drained; otherwise it would fade for ever [mg/ml].
constexpr double faintest = 1e-12;
/// After an injection the line is flushed with so many times what it holds (estimate) [-], when the syringe
/// has been taken off [s].
constexpr double flushed = 3, flush_waits = 1;

}  // namespace

double contrast_limit(double weight, double creatinine) {
    return std::min(300.0, 5.0 * weight / creatinine);
}

double leak_rate(double diameter, double mean_pressure) {
    constexpr double discharge = 0.6, open = 0.25;                       // [-]
    constexpr double density = 1060;                                     // [kg/m³]
    const double pressure = mean_pressure * 133.322;                     // [Pa]
    const double area = std::numbers::pi / 4 * diameter * diameter;      // [mm²]
    return discharge * open * area * std::sqrt(2 * pressure / density);  // mm² m/s = ml/s
}

ContrastFlow::ContrastFlow(const anatomy::Anatomy& anatomy, const FlowSpec& spec)
    : spec_(spec), blood_(blood_flow(anatomy, spec)) {
    for (const geometry::CentrelineBranch& branch : anatomy.branches) branches_.push_back(branch.name);
    const std::size_t count = blood_.cells.size();
    only_child_.assign(count, -1);
    std::vector<int> children(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
        const FlowCell& cell = blood_.cells[i];
        nodes_.push_back(cell.centre);
        radii_.push_back(static_cast<float>(cell.radius));
        upstream_.push_back(cell.upstream);
        volume_.push_back(cell.volume);
        if (cell.upstream >= 0)
            only_child_[cell.upstream] = ++children[cell.upstream] == 1 ? static_cast<int>(i) : -1;
    }
    for (auto* array : {&into_, &added_, &added_iodine_, &outflow_, &change_, &diagonal_, &right_})
        array->resize(count);
    resting_ = blood_.resting();
    distal_ = DistalArteries(blood_.outlets);
    veins_ = DistalArteries(blood_.outlets, &Outlet::venous);
    leaving_.resize(blood_.outlets.size());
    reached_.resize(blood_.outlets.size());
    reset();
}

void ContrastFlow::reset() {
    time_ = injected_ = injected_iodine_ = drained_ = 0;
    running_.clear();
    through_.clear();
    lines_.clear();
    site_ = {};
    holes_.clear();
    iodine_.assign(blood_.cells.size(), 0.0);
    distal_.reset();
    veins_.reset();
    tanks_.assign(blood_.outlets.size(), {});
    inner_.assign(blood_.outlets.size(), {});
    blush_.assign(blood_.outlets.size(), {});
    shown_.assign(blood_.cells.size(), 0.0f);
}

int ContrastFlow::entry_of(const std::string& name) const {
    auto found = std::ranges::find(branches_, name);
    if (found == branches_.end()) {
        found = std::ranges::find_if(
            branches_, [&](const std::string& branch) { return branch.starts_with(name + "+"); });
    }
    if (found == branches_.end()) {
        const std::vector<std::string_view> names(branches_.begin(), branches_.end());
        throw io::InputError("contrast cannot go into '{}': no such branch{}; branches are {}", name,
                             io::suggestion(name, names), io::joined(names));
    }
    return blood_.entry_of(static_cast<int>(found - branches_.begin()));
}

void ContrastFlow::inject(const Injection& asked) {
    std::vector<std::string> wrong;
    if (!(asked.rate > 0 && asked.rate <= render::largest_flow))
        wrong.push_back(fmt::format("an injection of {} ml/s; expected above 0 and at most {}", asked.rate,
                                    render::largest_flow));
    if (!(asked.volume > 0 && std::isfinite(asked.volume)))
        wrong.push_back(fmt::format("an injection of {} ml; expected more than 0", asked.volume));
    if (!(asked.iodine >= 0 && asked.iodine <= render::largest_iodine)) {
        wrong.push_back(
            fmt::format("contrast of {} mg/ml; expected 0 to {}", asked.iodine, render::largest_iodine));
    }
    if (!wrong.empty()) throw io::InputError("{}", fmt::join(wrong, "\n"));
    const auto* const place = std::get_if<geometry::Vec3>(&asked.at);
    if (place && !place->allFinite()) throw io::InputError("the place of an injection must be finite");
    const int cell = place ? blood_.nearest(*place) : entry_of(std::get<std::string>(asked.at));
    // Rounding must not reject the last of several doses that use up the limit exactly.
    if (asked.volume > left() + 1e-9 * spec_.limit) {
        throw io::InputError(
            "{:.4g} ml of contrast were asked for, but {:.4g} ml are left of the limit of {:.4g} ml",
            asked.volume, left(), spec_.limit);
    }
    running_.push_back({cell, asked.rate, asked.volume, asked.iodine});
    if (asked.line || !through_.empty()) {
        through_.resize(running_.size(), -1);
        if (asked.line) through_.back() = asked.line->number;
    }
    if (asked.line) {
        if (!used(asked.line->number)) lines_.emplace_back().number = asked.line->number;
        Used& line = *used(asked.line->number);
        drained_ += line.bore.resize(asked.line->bore);
        line.cell = cell;
        line.flush = asked.line->flush;
        line.to_flush = flushed * asked.line->bore;
        line.waits = flush_waits;
    }
    site_ = place ? site_at(*place, cell) : Site{};
}

ContrastFlow::Site ContrastFlow::site_at(const geometry::Vec3& place, int cell) const {
    const FlowCell& at = blood_.cells[static_cast<std::size_t>(cell)];
    const geometry::Vec3 aside = (place - at.centre) / at.radius;
    if (aside.isZero()) return {};
    return {cell, aside / std::max(1.0, aside.norm())};
}

ContrastFlow::Used* ContrastFlow::used(int line) {
    const auto found = std::ranges::find(lines_, line, &Used::number);
    return found == lines_.end() ? nullptr : &*found;
}

const ContrastFlow::Used* ContrastFlow::used(int line) const {
    return const_cast<ContrastFlow*>(this)->used(line);
}

void ContrastFlow::lead(int line, const geometry::Vec3& end, double bore) {
    Used* const led = used(line);
    if (!led || !end.allFinite()) return;
    drained_ += led->bore.resize(bore);
    const int cell = blood_.nearest(end);
    if (site_.cell == led->cell) site_ = site_at(end, cell);
    led->cell = cell;
    for (std::size_t k = 0; k < through_.size(); ++k)
        if (through_[k] == line) running_[k].cell = cell;
}

std::vector<float> ContrastFlow::in_line(int line, int parts) const {
    const Used* const led = used(line);
    return led ? led->bore.profile(parts) : std::vector<float>{};
}

ContrastFlow::Outflow ContrastFlow::out_of_line(int line) const {
    const Used* const led = used(line);
    return led ? led->out : Outflow{};
}

void ContrastFlow::pierce(const geometry::Vec3& place, const geometry::Vec3& outward, double diameter) {
    for (Hole& hole : holes_) {
        if ((hole.place - place).norm() > 0.5 * (hole.diameter + diameter)) continue;
        hole.diameter = std::max(hole.diameter, diameter);
        return;
    }
    holes_.push_back({blood_.nearest(place), place, outward, diameter, 0, 0});
}

void ContrastFlow::obstruct(std::span<const Obstruction> all) {
    if (all.empty() && !free_) return;
    if (!free_) free_ = blood_;
    if (all.empty())
        blood_ = *std::exchange(free_, std::nullopt);
    else
        blood_ = free_->obstructed(all);
    resting_ = blood_.resting();
    stirred_.clear();
    if (!free_ || blood_.cut_off == 0) return;
    stirred_ = free_->resting();
    for (std::size_t i = 0; i < stirred_.size(); ++i) {
        const bool before = blood_.tree[i] < static_cast<int>(blood_.sources.size());
        stirred_[i] = before && resting_[i] == 0 ? stirring * std::abs(stirred_[i]) : 0.0;
    }
}

double ContrastFlow::left() const {
    double used = injected_;
    for (const Running& injection : running_) used += injection.left;
    return std::max(0.0, spec_.limit - used);
}

/// Flow over the heart's cycle relative to its mean. The third power of a raised cosine is above half its
/// height for a quarter of the cycle, about as long as systole lasts; its mean is 5/16.
double ContrastFlow::pulse(double time) const {
    const double phase = 2 * std::numbers::pi * time * spec_.heart_rate / 60.0;
    const double raised = 0.5 - 0.5 * geometry::cos(phase);
    return 1 - spec_.pulsatility + spec_.pulsatility * raised * raised * raised * (16.0 / 5.0);
}

double ContrastFlow::injection_rate() const {
    double rate = 0;
    for (const Running& injection : running_) rate += injection.rate;
    return rate;
}

double ContrastFlow::time_left() const {
    double time = 0;
    for (const Running& injection : running_) time = std::max(time, injection.left / injection.rate);
    return time;
}

void ContrastFlow::step(double dt) {
    assert(dt >= 0);
    while (dt > 0) {
        double part = dt / std::max(1.0, std::ceil(dt / longest_part - 1e-9));
        // Ends no later than an injection.
        for (const Running& injection : running_) part = std::min(part, injection.left / injection.rate);
        advance(part);
        dt -= part;
    }
    show();
}

void ContrastFlow::inject_and_flush(double dt) {
    std::ranges::fill(added_, 0.0);
    std::ranges::fill(added_iodine_, 0.0);
    for (Used& line : lines_) line.out = {};
    const auto push = [dt](Used& line, double rate, double iodine) {
        const double out = line.bore.push(rate * dt, iodine) / dt;  // [mg/s]
        line.out.iodine = (line.out.iodine * line.out.flow + out) / (line.out.flow + rate);
        line.out.flow += rate;
        return out;
    };
    for (std::size_t k = 0; k < running_.size(); ++k) {
        Running& injection = running_[k];
        added_[injection.cell] += injection.rate;
        Used* const line = through_.empty() ? nullptr : used(through_[k]);
        added_iodine_[injection.cell] +=
            line ? push(*line, injection.rate, injection.iodine) : injection.rate * injection.iodine;
        const double volume = std::min(injection.left, injection.rate * dt);
        // A rounding residue of the volume would make the following steps tiny.
        injection.left = injection.left - volume < 1e-12 * injection.left ? 0 : injection.left - volume;
        injected_ += volume;
        injected_iodine_ += injection.rate * dt * injection.iodine;
    }
    for (Used& line : lines_) {
        if (line.out.flow > 0 || line.to_flush <= 0 || line.flush <= 0) continue;
        if (line.waits > 0) {
            line.waits -= dt;
            continue;
        }
        const double rate = std::min(line.flush, line.to_flush / dt);
        added_[line.cell] += rate;
        added_iodine_[line.cell] += push(line, rate, 0);
        line.to_flush -= rate * dt;
    }
}

void ContrastFlow::advance(double dt) {
    inject_and_flush(dt);
    std::ranges::fill(reached_, 0.0);
    const double pulse_now = pulse(time_ + 0.5 * dt);
    if (!holes_.empty()) leak(pulse_now, dt);
    const bool clear = running_.empty() && std::ranges::all_of(added_, [](double a) { return a <= 0; }) &&
                       std::ranges::all_of(iodine_, [](double c) { return c == 0; });
    if (clear) {
        for (std::size_t o = 0; o < leaving_.size(); ++o) leaving_[o] = pulse_now * blood_.outlets[o].flow;
    } else {
        blood_.balance(pulse_now, added_, into_, leaving_);
        carry(dt);
        spread(dt);
    }
    perfuse(dt);
    for (std::size_t k = running_.size(); k-- > 0;) {
        if (running_[k].left > 0) continue;
        running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(k));
        if (!through_.empty()) through_.erase(through_.begin() + static_cast<std::ptrdiff_t>(k));
    }
    time_ += dt;
}

/// What leaks takes its part of the flow: less is left for the ends, and more comes from upstream.
void ContrastFlow::leak(double pulse, double dt) {
    constexpr double most = 0.5;  // of what flows into a tree [-]
    leaking_.clear();
    for (Hole& hole : holes_) {
        const int tree = blood_.tree[static_cast<std::size_t>(hole.cell)];
        double all = 0;
        for (const Hole& other : holes_)
            if (blood_.tree[static_cast<std::size_t>(other.cell)] == tree)
                all += leak_rate(other.diameter, blood_.mean_pressure);
        const auto source = static_cast<std::size_t>(tree);
        const double inflow =
            source < blood_.sources.size() ? pulse * blood_.sources[source].inflow : 0.0;  // beyond a plug
        const double rate =
            leak_rate(hole.diameter, blood_.mean_pressure) * std::min(1.0, most * inflow / all);
        added_[hole.cell] -= rate;
        hole.blood += rate * dt;
        leaking_.push_back(rate);
    }
}

void ContrastFlow::carry(double dt) {
    const int count = static_cast<int>(iodine_.size());
    for (int i = 0; i < count; ++i) outflow_[i] = std::max(0.0, -into_[i]);
    for (int i = 0; i < count; ++i)
        if (upstream_[i] >= 0) outflow_[upstream_[i]] += std::max(0.0, into_[i]);
    for (std::size_t o = 0; o < leaving_.size(); ++o) outflow_[blood_.outlets[o].cell] += leaving_[o];
    for (std::size_t h = 0; h < holes_.size(); ++h) outflow_[holes_[h].cell] += leaking_[h];
    double fastest = 0;
    for (int i = 0; i < count; ++i) fastest = std::max(fastest, outflow_[i] / volume_[i]);
    const int substeps = std::max(1, static_cast<int>(std::ceil(dt * fastest / courant)));
    const double part = dt / substeps;

    // Blood passes from one cell into the next; `behind` is the cell before.
    struct Face {
        int cell, from, to, behind;  // cell: the one whose upstream face this is; behind: -1 = none
        double volume, kept;         // passing in a substep [ml]; the part of `from` that stays
    };
    std::vector<Face> faces;
    faces.reserve(count);
    for (int i = 0; i < count; ++i) {
        if (into_[i] == 0) continue;
        const int up = upstream_[i];
        Face face{i, up, i, -1, into_[i] * part, 0};
        if (up >= 0 && into_[i] > 0) {
            const bool straight = only_child_[up] == i && upstream_[up] >= 0 && into_[up] > 0;
            if (straight) face.behind = upstream_[up];
        } else {
            if (up < 0 && into_[i] > 0) continue;  // clean blood
            face.from = i, face.to = up;
            const int child = only_child_[i];
            if (up >= 0 && child >= 0 && into_[child] < 0) face.behind = child;
        }
        face.kept = 1 - part * outflow_[face.from] / volume_[face.from];
        faces.push_back(face);
    }
    for (int k = 0; k < substeps; ++k) {
        for (int i = 0; i < count; ++i) change_[i] = part * added_iodine_[i];
        for (const Face& face : faces) {
            double concentration = iodine_[face.from];
            if (face.behind >= 0) {
                const double before = iodine_[face.from] - iodine_[face.behind],
                             after = iodine_[face.to] - iodine_[face.from];
                if (before * after > 0) concentration += face.kept * before * after / (before + after);
            }
            if (concentration == 0) continue;
            const double mass = face.volume * concentration;
            change_[face.cell] += mass;
            if (upstream_[face.cell] >= 0)
                change_[upstream_[face.cell]] -= mass;
            else
                drained_ -= mass;
        }
        for (std::size_t o = 0; o < leaving_.size(); ++o) {
            const int cell = blood_.outlets[o].cell;
            const double mass = leaving_[o] * part * iodine_[cell];
            change_[cell] -= mass;
            if (const int into = blood_.outlets[o].into; into >= 0)
                change_[into] += mass;
            else
                reached_[o] += mass;
        }
        for (std::size_t h = 0; h < holes_.size(); ++h) {
            const double mass = leaking_[h] * part * iodine_[holes_[h].cell];
            change_[holes_[h].cell] -= mass;
            holes_[h].iodine += mass;
        }
        for (int i = 0; i < count; ++i) iodine_[i] += change_[i] / volume_[i];
    }
}

void ContrastFlow::spread(double dt) {
    const std::vector<FlowCell>& cells = blood_.cells;
    const int count = static_cast<int>(cells.size());
    // Backward Euler on a tree: eliminated from the ends to the source, substituted on the way back. The
    // exchange between neighbours [ml] goes into change_.
    for (int i = 0; i < count; ++i) {
        diagonal_[i] = volume_[i];
        right_[i] = volume_[i] * iodine_[i];
        // A vessel's contrast spreads along it, not back out of its origin.
        const double stirred = stirred_.empty() ? 0.0 : stirred_[i];
        const bool alone =
            upstream_[i] < 0 || (cells[i].branch != cells[upstream_[i]].branch && stirred == 0);
        const double flow = std::max(std::abs(into_[i]), stirred);
        change_[i] = alone ? 0 : dt * spec_.dispersion * cells[i].radius * flow / cells[i].distance;
    }
    for (int i = 0; i < count; ++i) {
        if (upstream_[i] < 0) continue;
        diagonal_[i] += change_[i];
        diagonal_[upstream_[i]] += change_[i];
    }
    for (int i = count - 1; i >= 0; --i) {
        if (upstream_[i] < 0) continue;
        const double fraction = change_[i] / diagonal_[i];
        diagonal_[upstream_[i]] -= fraction * change_[i];
        right_[upstream_[i]] += fraction * right_[i];
    }
    for (int i = 0; i < count; ++i) {
        const double from_upstream = upstream_[i] < 0 ? 0 : change_[i] * iodine_[upstream_[i]];
        iodine_[i] = (right_[i] + from_upstream) / diagonal_[i];
    }
    for (int i = 0; i < count; ++i) {
        if (iodine_[i] >= faintest) continue;
        drained_ += iodine_[i] * volume_[i];
        iodine_[i] = 0;
    }
}

void ContrastFlow::perfuse(double dt) {
    // Backward Euler: a mixed volume, what leaves it in this step.
    const auto through = [dt](double& mass, double arriving, double time) {
        const double rate = dt / time;
        mass = (mass + arriving) / (1 + rate);
        return rate * mass;
    };
    for (std::size_t o = 0; o < tanks_.size(); ++o) {
        const Outlet& outlet = blood_.outlets[o];
        const Inner& in = outlet.inner;
        double* const mass = tanks_[o].mass;
        double arriving = distal_.pass(static_cast<int>(o), reached_[o], leaving_[o], dt);
        if (in.fraction == 0 && in.filtered == 0) {
            for (int k = 0; k < 3; ++k) arriving = through(mass[k], arriving, outlet.transit / 3);
            drained_ += arriving;
            veins_.pass(static_cast<int>(o), arriving, leaving_[o], dt);
            const double held = mass[0] + mass[1] + mass[2];
            blush_[o] = {held, held / outlet.tissue};
            continue;
        }
        InnerTanks& inner = inner_[o];
        arriving = through(mass[0], arriving, outlet.transit / 3);
        const double filtered = in.filtered * arriving;
        arriving = through(mass[1], arriving - filtered, outlet.transit / 3);
        double deep = in.fraction * arriving;
        const double outer = through(mass[2], arriving - deep, outlet.transit / 3);
        drained_ += outer;
        for (double& vessels : inner.vessels) deep = through(vessels, deep, in.transit / 2);
        drained_ += deep;
        veins_.pass(static_cast<int>(o), outer + deep, leaving_[o], dt);
        drained_ += through(inner.inner_tubules, through(inner.outer_tubules, filtered, in.outer_tubules),
                            in.inner_tubules);
        const double held = mass[0] + mass[1] + mass[2] + inner.held();
        blush_[o] = {held, held / outlet.tissue, inner.held() - inner.outer_tubules};
    }
}

std::vector<Eigen::Vector3f> ContrastFlow::streams() const {
    using geometry::Vec3;
    constexpr double narrowest = 3.0;       // radius [mm]
    constexpr double mixing = 8.0;          // length over diameter [-]
    constexpr double gravity = 9.81;        // [m/s²]
    constexpr double denser = 0.255 / 300;  // Δρ/ρ of contrast by its iodine, 1.33 g/ml at 300 mg/ml [ml/mg]
    const Vec3 down = Vec3::UnitY();        // the back
    const std::size_t count = iodine_.size();
    std::vector<Eigen::Vector3f> streams(count, Eigen::Vector3f::Zero());
    bool any = false;
    std::vector<double> passed(count, -1.0);  // from the site, downstream [mm]
    double source = 0;
    for (const BloodFlow::Source& tree : blood_.sources) source = std::max(source, tree.inflow);
    const double faster = source > 0 ? 1 + injection_rate() / source : 1;
    for (std::size_t i = 0; i < count; ++i) {
        const FlowCell& cell = blood_.cells[i];
        if (static_cast<int>(i) == site_.cell) passed[i] = 0;
        if (cell.upstream >= 0 && passed[cell.upstream] >= 0)
            passed[i] = passed[cell.upstream] + cell.distance;
        if (cell.radius < narrowest || iodine_[i] < 1e-3) continue;
        const int other = cell.upstream >= 0 ? cell.upstream : only_child_[i];
        if (other < 0) continue;
        const Vec3 axis = (cell.centre - blood_.cells[other].centre).normalized();
        const auto across = [&](const Vec3& v) -> Vec3 { return v - v.dot(axis) * axis; };
        const double diameter = 2e-3 * cell.radius;  // [m]
        const double speed = std::max(1e-6, 1e-6 * faster * std::abs(resting_[i]) /
                                                (std::numbers::pi * diameter * diameter / 4));  // [m/s]
        const Vec3 fall = across(down);
        const double richardson = gravity * fall.norm() * denser * iodine_[i] * diameter / (speed * speed);
        Vec3 gradient = richardson / (1 + richardson) * fall;
        if (passed[i] >= 0)
            gradient += geometry::exp(-passed[i] / (mixing * 2 * cell.radius)) * across(site_.aside);
        gradient /= std::max(1.0, gradient.norm());
        if (!gradient.allFinite() || gradient.isZero()) continue;
        streams[i] = gradient.cast<float>();
        any = true;
    }
    if (!any) streams.clear();
    return streams;
}

void ContrastFlow::show() {
    for (std::size_t i = 0; i < iodine_.size(); ++i) shown_[i] = static_cast<float>(iodine_[i]);
    distal_.show();
    veins_.show();
}

IodineBalance ContrastFlow::balance() const {
    IodineBalance now;
    now.injected = injected_iodine_;
    now.drained = drained_;
    for (std::size_t i = 0; i < iodine_.size(); ++i) now.in_vessels += iodine_[i] * volume_[i];
    for (std::size_t o = 0; o < blush_.size(); ++o) {
        now.in_organs += blush_[o].iodine + distal_.held(static_cast<int>(o));
        now.in_veins += veins_.held(static_cast<int>(o));
    }
    for (const Hole& hole : holes_) now.leaked += hole.iodine;
    for (const Used& line : lines_) now.in_lines += line.bore.iodine();
    return now;
}

}  // namespace blood
