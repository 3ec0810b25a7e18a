#include "physics/wire/device.h"

#include <Eigen/Geometry>
#include <cassert>
#include <cmath>
#include <sstream>

#include "physics/geometry/maths.h"

namespace physics {
namespace {

double between(double distal, double proximal, double fraction) {
    assert(fraction >= 0 && fraction <= 1);
    if (distal == proximal) return distal;
    const double value = distal * geometry::pow(proximal / distal, fraction);
    assert(value > std::min(distal, proximal) * (1 - 1e-9) &&
           value < std::max(distal, proximal) * (1 + 1e-9));
    return value;
}

template <class Value>
double value_at(const DeviceSpec& spec, double s, const Value& value) {
    assert(!spec.sections.empty());
    for (std::size_t k = 0; k + 1 < spec.sections.size(); ++k) {
        const StiffnessSection& section = spec.sections[k];
        if (s <= section.length) return value(section, std::max(0.0, s) / section.length);
        s -= section.length;
    }
    const StiffnessSection& last = spec.sections.back();
    return value(last, last.length > 0 ? std::clamp(s / last.length, 0.0, 1.0) : 1.0);
}

}  // namespace

std::vector<StiffnessSection> soft_tip(double tip, double tip_length, double transition_length, double shaft,
                                       double torsional) {
    const double tip_torsional = torsional * tip / shaft;
    std::vector<StiffnessSection> sections;
    if (tip_length > 0) sections.push_back({tip_length, tip, tip, tip_torsional, tip_torsional});
    if (transition_length > 0) sections.push_back({transition_length, tip, shaft, tip_torsional, torsional});
    sections.push_back({0, shaft, shaft, torsional, torsional});
    return sections;
}

void stiffen(DeviceSpec& spec) {
    for (StiffnessSection& section : spec.sections) section.torsional_distal = section.torsional_proximal = 0;
    assert(!spec.twists());
}

std::vector<std::string> problems(const DeviceSpec& s) {
    std::vector<std::string> out;
    const auto need = [&](const std::string& name, double value, double least, double most,
                          const char* unit) {
        if (std::isfinite(value) && value >= least && value <= most) return;
        std::ostringstream text;
        text << name << " must lie in [" << least << ", " << most << "] " << unit << '.';
        out.push_back(text.str());
    };
    using Limits = DeviceLimits;
    need("outer_diameter", s.outer_diameter, 1e-3, Limits::diameter, "mm");
    need("inner_diameter", s.inner_diameter, 0, s.outer_diameter, "mm");
    if (s.sections.empty()) out.push_back("a device needs a section of stiffness.");
    for (std::size_t k = 0; k < s.sections.size(); ++k) {
        const StiffnessSection& section = s.sections[k];
        const std::string at = "section " + std::to_string(k + 1) + ": ";
        const bool last = k + 1 == s.sections.size();
        need(at + "length", section.length, last ? 0 : 1e-3, last ? 1e4 : Limits::section_length, "mm");
        for (const double ei : {section.rigidity_distal, section.rigidity_proximal})
            need(at + "rigidity", ei, 1e-6, Limits::rigidity, "N·mm²");
        for (const double gj : {section.torsional_distal, section.torsional_proximal})
            need(at + "torsional_rigidity", gj, 0, Limits::rigidity, "N·mm²");
        if ((section.torsional_distal > 0) != s.twists() || (section.torsional_proximal > 0) != s.twists())
            out.push_back(at + "the torsional rigidity must be 0 in all sections or in none.");
    }
    need("friction", s.friction, 0, Limits::friction, "");
    need("inner_friction", s.inner_friction, 0, Limits::friction, "");
    need("valve_friction", s.valve_friction, 0, Limits::valve_friction, "N");
    const auto need_static = [&](const char* name, double value, double kinetic, double most,
                                 const char* unit) {
        if (value != 0) need(name, value, kinetic, most, unit);
    };
    need_static("static_friction", s.static_friction, s.friction, Limits::friction, "");
    need_static("static_inner_friction", s.static_inner_friction, s.inner_friction, Limits::friction, "");
    need_static("static_valve_friction", s.static_valve_friction, s.valve_friction, Limits::valve_friction,
                "N");
    need("buckling_force", s.buckling_force, 0, Limits::buckling_force, "N");
    need("length", s.length, 1, 1e4, "mm");
    // Rounding in a conversion from degrees must not reject the limit itself.
    const double most_angle = Limits::arc_angle * degree + 1e-9;
    for (const RestArc& arc : s.shape) {
        need("shape.length", arc.length, 1e-3, Limits::arc_length, "mm");
        need("shape.angle", arc.angle, -most_angle, most_angle, "rad");
        need("shape.plane", arc.plane, -M_PI - 1e-9, M_PI + 1e-9, "rad");
    }
    if (out.empty() && shaped_length(s) > s.length)
        out.push_back("the shape must not be longer than the device.");
    return out;
}

double rigidity_at(const DeviceSpec& spec, double s) {
    return value_at(spec, s, [](const StiffnessSection& section, double fraction) {
        return between(section.rigidity_distal, section.rigidity_proximal, fraction);
    });
}

double torsional_rigidity_at(const DeviceSpec& spec, double s) {
    return value_at(spec, s, [](const StiffnessSection& section, double fraction) {
        return between(section.torsional_distal, section.torsional_proximal, fraction);
    });
}

double shaped_length(const DeviceSpec& spec) {
    double sum = 0;
    for (const RestArc& arc : spec.shape) sum += arc.length;
    return sum;
}

double torsional_give(const DeviceSpec& spec, double from, double to) {
    assert(spec.twists() && from <= to);
    double give = 0, start = 0;
    for (std::size_t k = 0; k < spec.sections.size() && start < to; ++k) {
        const StiffnessSection& section = spec.sections[k];
        const bool last = k + 1 == spec.sections.size();
        const double end = last ? to : start + section.length, a = std::max(from, start),
                     b = std::min(to, end);
        const double ratio = section.torsional_proximal / section.torsional_distal;
        if (b > a && ratio == 1)
            give += (b - a) / section.torsional_distal;
        else if (b > a && section.length > 0) {
            // ∫ ds/GJ with GJ = GJ_distal ratio^((s − start)/length); beyond the last section's length GJ
            // stays.
            const double rise = geometry::log(ratio) / section.length, whole = start + section.length;
            const double tapered = std::min(b, whole);
            if (tapered > a)
                give += (geometry::exp(-rise * (a - start)) - geometry::exp(-rise * (tapered - start))) /
                        (rise * section.torsional_distal);
            give += std::max(0.0, b - std::max(a, whole)) / section.torsional_proximal;
        }
        start = end;
    }
    assert(give >= 0 && (give > 0 || from == to));
    return give;
}

double varying_length(const DeviceSpec& spec) {
    assert(!spec.sections.empty());
    const double hub = spec.sections.back().rigidity_proximal;
    double sum = 0, varying = 0;
    for (const StiffnessSection& section : spec.sections) {
        sum += section.length;
        if (section.rigidity_distal != hub || section.rigidity_proximal != hub) varying = sum;
    }
    return std::max(varying, shaped_length(spec));
}

RestBend rest_bend(const Device& device, int joint, const Vec3& u, const Vec3& director) {
    assert(joint >= 0 && joint < static_cast<int>(device.rest.size()));
    const RestTurn& rest = device.rest[joint];
    if (rest.angle == 0) return {};
    const double angle = device.angle_at(joint), c = geometry::cos(angle), s = geometry::sin(angle);
    const Vec2 direction(c * rest.direction[0] - s * rest.direction[1],
                         s * rest.direction[0] + c * rest.direction[1]);
    assert(std::abs(direction.squaredNorm() - 1) < 1e-9);
    assert(std::abs(director.squaredNorm() - 1) < 1e-6 && std::abs(director.dot(u)) < 1e-6);
    return {rest.cosine, rest.sine, direction[0] * director + direction[1] * u.cross(director)};
}

Vec3 rest_direction(const Vec3& u, const RestBend& rest) {
    assert(std::abs(rest.cosine * rest.cosine + rest.sine * rest.sine - 1) < 1e-9);
    if (rest.straight()) return u;
    assert(std::abs(rest.direction.squaredNorm() - 1) < 1e-6 && std::abs(rest.direction.dot(u)) < 1e-6);
    return rest.cosine * u + rest.sine * rest.direction;
}

double varying_length(const Device& device) {
    double length = varying_length(device.spec);
    for (const Bulge& bulge : device.bulge) length = std::max(length, bulge.from_tip + bulge.length());
    return length;
}

double Bulge::radius(double s) const {
    const double at = (s - from_tip) / spacing;
    if (radii.empty() || at < 0 || at > static_cast<double>(radii.size() - 1)) return 0;
    const auto k = std::min(static_cast<std::size_t>(at), radii.size() - 1),
               next = std::min(k + 1, radii.size() - 1);
    return radii[k] + (at - static_cast<double>(k)) * (radii[next] - radii[k]);
}

}  // namespace physics
