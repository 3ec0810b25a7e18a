#include "physics/wall/past_end.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

constexpr double turn = 4;  // grid nodes past the plane in which the field becomes that of the plane
constexpr double passing_fraction = 1;  // of the end's radius
constexpr double passing_root = 0.3;    // of that of an aorta
constexpr double starts_over = 0.25;    // of the end's radius: the narrowing
constexpr double closes_over = 1;       // way past a cone's last place [mm]
constexpr double seam_fades = 0.7;      // over which a seam ends around its axis [mm]

double square(double x) {
    return x * x;
}

/// 0 to 1 as t goes from 0 to 1, twice continuously differentiable, with its derivatives and its integral.
struct SmoothStep {
    double value, slope, curve, integral;
    explicit SmoothStep(double t) {
        t = std::clamp(t, 0.0, 1.0);
        value = t * t * t * (10 + t * (6 * t - 15));
        slope = 30 * t * t * (1 - t) * (1 - t);
        curve = 60 * t * (1 - t) * (1 - 2 * t);
        integral = t * t * t * t * (2.5 + t * (t - 3));
    }
};

/// A way that starts smoothly at 0, over `start` [mm], and its derivatives.
struct SmoothStart {
    double value, slope, curve;
    SmoothStart(double t, double start) {
        const SmoothStep step(t / start);
        value = start * step.integral + std::max(0.0, t - start);
        slope = step.value;
        curve = step.slope / start;
    }
};

/// The cone whose joint on the axis has this radius to go.
RoundCone open_to(double radius, double core) {
    RoundCone cone;
    cone.radius = radius + RoundCone::on_axis * core;
    cone.core = core;
    return cone;
}

/// The root of an aorta, in radii of its sinotubular junction. Diameters of 29 mm at the junction, 34 mm at
/// the sinuses (echography of 135 adults: Roman 1989, Am J Cardiol 64:507); the cusps' lowest places 21 mm
/// below the junction (Schäfers 2006, J Thorac Cardiovasc Surg 132:436). Three balls of a circle's third
/// each are the sinuses; between them the cusps rise from the middle to the junction, and are lowest where
/// they meet: 9 mm above their lowest places (as Schäfers has it; 9.8 ± 0.9 mm in repaired valves that hold:
/// Bierbach 2010, Eur J Cardiothorac Surg 38:400).
struct Root {
    static constexpr double sinus = 0.55, off_axis = 0.62, centre = 0.94 + passing_root, narrows = 0.2;
    /// Where the narrowing ball of the junction ends on the axis.
    static constexpr double meet = 1.15;
};

/// The middle of the closed valve. A pressure of 9.33 kPa (70 mmHg), the lower of the two at which Hamid,
/// Sabbah and Stein (1985, Eng Fract Mech 21:773) load a closed leaflet; the cusps' curvature is that of the
/// sinuses that they close.
Seam seam_of(double r) {
    constexpr double diastolic = 9.33e-3, lie_on_each_other = 5;  // [N/mm²]; [mm] (from memory: 4 to 5)
    Seam seam;
    seam.half = lie_on_each_other;
    seam.middle = Root::meet * r + seam.half;
    seam.reach = 1.7;
    seam.pressure = diastolic;
    seam.curvature = Root::sinus * r;
    return seam;
}

/// The root of an aorta of radius r at the sinotubular junction, and the left ventricle.
void add_root(const OpenEnd& end, RoundCones& cones) {
    // Wide enough for a catheter of 6 F, which must part the cusps; a larger one would cut into the sinuses
    // [mm].
    constexpr double hole = 1.1, hole_core = 0.3;
    // 47 mm across and 87 mm long, at the end of diastole (Lang 2015, J Am Soc Echocardiogr 28:1) [mm].
    constexpr double ventricle = 23.5, ventricle_length = 40, cusp = 3;
    const double r = end.radius, floor = floor_of_root(end) + cusp;
    RoundCone junction;
    junction.radius = r;
    junction.narrows = Root::narrows;
    junction.starts = junction.last = passing_root * r;
    cones.add(junction);
    Vec3 u, v;
    tangent_basis(end.outward_normal, u, v);
    if (!end.faces.isZero(0)) {
        u = end.faces;
        v = end.outward_normal.cross(u);
    }
    for (int k = 0; k < 3; ++k) {
        const double angle = 2 * std::numbers::pi / 3 * k;
        RoundCone ball;
        ball.aside = Root::off_axis * r * (geometry::cos(angle) * u + geometry::sin(angle) * v);
        ball.radius = Root::sinus * r;
        ball.first = ball.last = Root::centre * r;
        cones.add(ball);
    }
    RoundCone through = open_to(hole, hole_core);
    through.first = Root::meet * r;
    through.last = floor + cusp;
    cones.add(through);
    cones.seam = seam_of(r);
    RoundCone chamber;
    chamber.radius = ventricle;
    chamber.first = floor + ventricle;
    chamber.last = chamber.first + ventricle_length;
    cones.add(chamber);
}

}  // namespace

double Seam::force(double joint) const {
    return 8.0 / 3 * std::numbers::sqrt2 * pressure * std::sqrt(curvature * joint) * joint;
}

double Seam::squeeze(double joint) const {
    return 1.5 * force(joint) / joint;
}

double floor_of_root(const OpenEnd& end) {
    return (Root::centre + Root::sinus) * end.radius + 0.5 * closes_over;
}

RoundCones cones_past(const OpenEnd& end) {
    RoundCones cones;
    if (end.goes_on == Continuation::Root) {
        add_root(end, cones);
        return cones;
    }
    const double r = end.radius;
    RoundCone vessel;
    vessel.radius = r;
    vessel.core = std::min(vessel.core, 0.25 * r);
    if (end.goes_on == Continuation::Sheath) {
        cones.add(vessel);
        RoundCone tube = open_to(end.bore, std::min(vessel.core, 0.25 * end.bore));
        tube.first = 0;
        tube.last = end.length;
        cones.add(tube);
        return cones;
    }
    const double whole = PastEnd::narrows_over * r, left = open_to(PastEnd::goes_in, vessel.core).radius;
    vessel.last = std::min(whole, end.length);
    vessel.narrows = std::max(0.0, r - left) / whole;
    cones.add(vessel);
    return cones;
}

double radius_past(const OpenEnd& end, const Vec3& x) {
    const double past = (x - end.centre).dot(end.outward_normal);
    const Vec3 beside = x - end.centre - past * end.outward_normal;
    if (past <= 0 || beside.norm() > end.radius) return std::numeric_limits<double>::infinity();
    if (end.goes_on == Continuation::Sheath) return past < end.length ? 0 : end.radius;
    if (end.goes_on == Continuation::Root) return end.radius;
    const double narrows = (end.radius - PastEnd::goes_in) / (PastEnd::narrows_over * end.radius);
    return std::max(PastEnd::goes_in, end.radius - narrows * past);
}

std::vector<ContinuedEnd> continued_ends(std::span<const OpenEnd> ends) {
    std::vector<ContinuedEnd> all;
    for (const OpenEnd& end : ends) all.push_back({end, cones_past(end)});
    return all;
}

PastEnd::PastEnd(const Vec3& x, std::span<const ContinuedEnd> ends, std::span<const int> at, double spacing) {
    for (const int e : at) {
        const double t = (x - ends[e].end.centre).dot(ends[e].end.outward_normal);
        if (t <= past_) continue;
        past_ = t;
        end_ = &ends[e];
    }
    if (!end_) return;
    constexpr double at_once = 1e-9;  // [mm]
    const double fraction = end_->end.goes_on == Continuation::Root ? passing_root : passing_fraction;
    passing_ = spacing > 0 ? fraction * end_->end.radius : at_once;
    const double length = std::max(turn * spacing, at_once);
    const SmoothStep step(past_ / length);
    kept_ = std::min(past_, length) - length * step.integral;
    slope_ = 1 - step.value;
    curve_ = -step.slope / length;
}

/// Chain rule of x ↦ seen_at(x), and of the depth ending smoothly where it is not known.
void PastEnd::flatten(double known, WallContact& c) const {
    // A joint may be asked about thicker than its device, by what a segment keeps clear of the wall.
    constexpr double least_known = 0.05;  // [mm]
    known = std::max(known, least_known);
    const Vec3& out = end_->end.outward_normal;
    const SmoothStart depth(c.penetration + known, known);
    c.penetration = depth.value - 0.5 * known;
    c.curvature = depth.slope * c.curvature + depth.curve * c.normal * c.normal.transpose();
    c.normal *= depth.slope;
    const double along = c.normal.dot(out);
    const Mat3 section = Mat3::Identity() - (1 - slope_) * out * out.transpose();
    c.curvature = section * c.curvature * section + along * curve_ * out * out.transpose();
    c.normal -= (1 - slope_) * along * out;
}

PastEnd::Depth PastEnd::depth(const Vec3& x) const {
    const Vec3& out = end_->end.outward_normal;
    const Mat3 along = out * out.transpose();
    const Vec3 beside = x - end_->end.centre - past_ * out;
    const auto of = [&](const RoundCone& cone) {
        const SmoothStart ahead(past_ - cone.last, closes_over), back(cone.first - past_, closes_over),
            along_cone(past_ - cone.starts, starts_over * end_->end.radius);
        const Vec3 w = beside - cone.aside + (ahead.value * ahead.slope - back.value * back.slope) * out;
        const double curve_of_w = ahead.slope * ahead.slope + ahead.value * ahead.curve +
                                  back.slope * back.slope + back.value * back.curve;
        const double square =
            (beside - cone.aside).squaredNorm() + ahead.value * ahead.value + back.value * back.value;
        // φ and its derivatives by the square of its argument.
        const double c = cone.core, q = std::sqrt(square);
        const bool in_core = q < c;
        const double phi = in_core ? c / 8 * (3 + square / (c * c) * (6 - square / (c * c))) : q,
                     slope = in_core ? (6 - 2 * square / (c * c)) / (8 * c) : 1 / (2 * q),
                     curve = -1 / (4 * geometry::pow(in_core ? c : q, 3));
        Depth d;
        d.value = phi - cone.radius + cone.narrows * along_cone.value;
        d.slope = 2 * slope * w + cone.narrows * along_cone.slope * out;
        d.curve = 2 * slope * (Mat3::Identity() - along + curve_of_w * along) +
                  4 * curve * w * w.transpose() + cone.narrows * along_cone.curve * along;
        d.steepest = 1 + cone.narrows;
        return d;
    };
    const RoundCones& cones = end_->cones;
    if (cones.count == 1) return of(cones.cones[0]);
    std::array<Depth, RoundCones::most> depths;
    const auto all = std::span(depths).first(cones.count);
    std::ranges::transform(cones.all(), all.begin(), of);
    const double least = std::ranges::min(all, {}, &Depth::value).value;
    Depth sum{0, Vec3::Zero(), Mat3::Zero(), 1};
    for (const Depth& d : all) {
        const double weight = geometry::exp((least - d.value) / rounding);
        sum.value += weight;
        sum.slope += weight * d.slope;
        sum.curve += weight * (d.curve - d.slope * d.slope.transpose() / rounding);
        sum.steepest = std::max(sum.steepest, d.steepest);
    }
    sum.slope /= sum.value;
    sum.curve = sum.curve / sum.value + sum.slope * sum.slope.transpose() / rounding;
    sum.value = least - rounding * geometry::log(sum.value);
    return sum;
}

void PastEnd::apply(const Vec3& x, double joint, double known, WallContact& c) const {
    assert(!inside());
    const Vec3& out = end_->end.outward_normal;
    const Depth round = depth(x);
    const double round_value = round.value + joint, round_trust = -round_value / round.steepest;
    if (alone()) {
        c.penetration = round_value;
        c.normal = round.slope;
        c.curvature = round.curve;
        c.trust = std::clamp(round_trust, 0.0, past_ - passing_);
        return;
    }
    const SmoothStep step(past_ / passing_);
    const double slope = step.slope / passing_, curve = step.curve / (passing_ * passing_);
    flatten(known, c);
    const double more = round_value - c.penetration;
    const Vec3 steeper = round.slope - c.normal;
    const Mat3 cross = slope * steeper * out.transpose();
    c.curvature += step.value * (round.curve - c.curvature) + cross + cross.transpose() +
                   curve * more * out * out.transpose();
    c.normal += step.value * steeper + slope * more * out;
    c.penetration += step.value * more;
    // Between two walls that are not touched lies none.
    c.trust = std::max(0.0, std::min(c.trust, round_trust));
}

void PastEnd::part_cusps(const Vec3& x, double joint, double joint_length, WallContact& c) const {
    if (!end_ || end_->cones.seam.half == 0 || joint <= 0) return;
    const Seam& seam = end_->cones.seam;
    const Vec3& out = end_->end.outward_normal;
    const Vec3 beside = x - end_->end.centre - past_ * out;
    const double t = (past_ - seam.middle) / seam.half, full = square(seam.reach - seam_fades),
                 over = square(seam.reach) - full;
    const double away = std::max(std::abs(past_ - seam.middle) - seam.half, beside.norm() - seam.reach);
    if (away >= 0) {
        c.trust = std::min(c.trust, away);
        return;
    }
    // How far they are parted: all along it to nothing at its ends, and around it.
    const double within = 1 - t * t;
    const SmoothStep fade((beside.squaredNorm() - full) / over);
    const double fraction = within * within * within, slope = -6 * t * within * within / seam.half,
                 curve = 6 * within * (5 * t * t - 1) / (seam.half * seam.half), around = 1 - fade.value;
    const Vec3 fades = -2 * fade.slope / over * beside;
    const Mat3 axis = out * out.transpose();
    const Mat3 cross = slope * fades * out.transpose();
    const double parted = fraction * around;
    const Vec3 first = slope * around * out + fraction * fades;
    const Mat3 second = curve * around * axis + cross + cross.transpose() -
                        fraction * (2 * fade.slope / over * (Mat3::Identity() - axis) +
                                    4 * fade.curve / (over * over) * beside * beside.transpose());
    // Of the cusps, k d²/2 with d = 4/3 a where they are parted.
    const double whole = 4.0 / 3 * joint, k = joint_length * seam.squeeze(joint) / whole, d = whole * parted;
    const Vec3 push = k * d * whole * first + (c.touches() ? c.push() : Vec3(Vec3::Zero()));
    const double energy = 0.5 * k * d * d + (c.touches() ? c.energy() : 0), force = k * d + c.force();
    Mat3 hessian = k * whole * (whole * first * first.transpose() + d * second);
    if (c.touches()) hessian += c.stiffness * c.normal * c.normal.transpose() + c.force() * c.curvature;
    c.trust = 0;
    if (!(force > 0)) return;
    c.penetration = 2 * energy / force;
    c.stiffness = force / c.penetration;
    c.stiffening.setZero();
    c.normal = push / force;
    c.curvature = (hessian - c.stiffness * c.normal * c.normal.transpose()) / force;
}

void PastEnd::limit(const Vec3& x, double joint, WallContact& c) const {
    if (!end_ || c.trust <= -past_) return;
    const Depth round = depth(x);
    c.trust = std::min(c.trust, std::max(-past_, -(round.value + joint) / round.steepest));
}

}  // namespace physics
