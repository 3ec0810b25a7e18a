#include "engine/scenario/device.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <toml++/toml.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"
#include "engine/scenario/device_treatment.h"
#include "physics/geometry/maths.h"

namespace scenario {
namespace {

using geometry::Polyline;
using geometry::Vec3;

constexpr double longest_device = 3500;                // [mm]
constexpr double longest_tip = 1000;                   // and its transition [mm]
constexpr double longest_bend = 200, most_bend = 270;  // of a scenario's [mm], [deg]
constexpr std::string_view kinds[] = {"wire", "catheter", "balloon", "stent"};

io::Range up_to(double most) {
    return {0, most};
}

/// Calls number(key, value, range) for each number of a device, those of its stiffness where there is one.
template <class Number>
void each_value(Device& d, TipAndShaft* stiffness, const Number& number) {
    using Limits = physics::DeviceLimits;
    number("length_mm", d.length, io::Range{100, longest_device});
    number("outer_diameter_mm", d.outer_diameter, io::Range{0.05, Limits::diameter});
    if (has_lumen(d.kind)) number("inner_diameter_mm", d.inner_diameter, io::Range{0.05, Limits::diameter});
    if (stiffness) {
        number("shaft_rigidity_N_mm2", stiffness->shaft_rigidity, io::Range{1e-3, Limits::rigidity});
        number("tip_rigidity_N_mm2", stiffness->tip_rigidity, io::Range{1e-3, Limits::rigidity});
        number("tip_length_mm", stiffness->tip_length, up_to(longest_tip));
        number("transition_length_mm", stiffness->transition_length, up_to(longest_tip));
        number("torsional_rigidity_N_mm2", stiffness->torsional_rigidity, up_to(Limits::rigidity));
    }
    number("friction", d.friction, up_to(Limits::friction));
    number("buckling_force_N", d.buckling_force, up_to(Limits::buckling_force));
}

/// The same for those numbers that a device need not have.
template <class Number>
void each_further_value(Device& d, const Number& number) {
    using Limits = physics::DeviceLimits;
    number("static_friction", d.static_friction, up_to(Limits::friction));
    if (has_lumen(d.kind)) {
        number("inner_friction", d.inner_friction, up_to(Limits::friction));
        number("static_inner_friction", d.static_inner_friction, up_to(Limits::friction));
    }
    number("valve_friction_N", d.valve_friction, up_to(Limits::valve_friction));
    number("static_valve_friction_N", d.static_valve_friction, up_to(Limits::valve_friction));
    if (d.kind == DeviceKind::Balloon || d.kind == DeviceKind::Stent)
        number("wire_lumen_mm", d.wire_lumen, io::Range{10, longest_device});
}

/// A kinetic value of friction, the static one of the same surface, and their keys.
struct FrictionPair {
    const char *key, *static_key;
    double &slides, &still;
};

/// Calls use(pair) for each surface that the device has.
template <class Use>
void each_friction(Device& d, const Use& use) {
    use(FrictionPair{"friction", "static_friction", d.friction, d.static_friction});
    if (has_lumen(d.kind))
        use(FrictionPair{"inner_friction", "static_inner_friction", d.inner_friction,
                         d.static_inner_friction});
    use(FrictionPair{"valve_friction_N", "static_valve_friction_N", d.valve_friction,
                     d.static_valve_friction});
}

/// Refuses a static value below the kinetic one.
void check_static_values(io::Section& section, Device& d) {
    each_friction(d, [&](const FrictionPair& f) {
        if (const toml::node* node = section.find(f.static_key); node && f.still != 0 && f.still < f.slides)
            section.refuse(
                f.static_key, *node,
                fmt::format("expected 0, or a value that is not below '{}', {:g}", f.key, f.slides));
    });
}

/// The keys that need a source.
void read_values(io::Section& top, Device& d, std::vector<std::string>& given) {
    TipAndShaft stiffness;
    const bool listed = !d.sections.empty();
    each_value(d, listed ? nullptr : &stiffness, [&](const char* key, double& value, io::Range range) {
        if (!top.find(key))
            top.missing(key, std::string(key) + " = ...");
        else
            given.emplace_back(key);
        top.number(key, value, range);
    });
    each_further_value(d, [&](const char* key, double& value, io::Range range) {
        if (top.find(key)) given.emplace_back(key);
        top.number(key, value, range);
    });
    check_static_values(top, d);
    if (!listed) set_stiffness(d, stiffness);
}

/// Keys of one value all along a section, and of one at its distal and one at its proximal end.
using EndKeys = const char* const[3];
constexpr EndKeys rigidity_keys = {"rigidity_N_mm2", "distal_rigidity_N_mm2", "proximal_rigidity_N_mm2"},
                  torsional_keys = {"torsional_rigidity_N_mm2", "distal_torsional_rigidity_N_mm2",
                                    "proximal_torsional_rigidity_N_mm2"};

void read_ends(io::Section& section, const EndKeys& keys, io::Range range, double& distal, double& proximal) {
    const bool one = section.find(keys[0]), both = section.find(keys[1]) && section.find(keys[2]);
    if (one == both || one == (section.find(keys[1]) || section.find(keys[2])))
        section.refuse_whole(fmt::format("expected either {} or both {} and {}", keys[0], keys[1], keys[2]));
    section.number(keys[0], distal, range);
    proximal = distal;
    section.number(keys[1], distal, range);
    section.number(keys[2], proximal, range);
}

void read_sections(io::Section& top, Device& d, std::vector<std::string>& given) {
    using Limits = physics::DeviceLimits;
    std::vector<io::Section> tables = top.sections("section");
    if (tables.empty()) return;
    double along = 0;
    for (std::size_t k = 0; k < tables.size(); ++k) {
        io::Section& table = tables[k];
        physics::StiffnessSection& section = d.sections.emplace_back();
        const bool last = k + 1 == tables.size(), has_length = table.find("length_mm") != nullptr;
        if (has_length == last)
            table.refuse_whole(
                last ? "expected no length_mm in the last section, which runs to the hub, found one"
                     : "expected length_mm of a section before the last, found none");
        section.length = std::max(1e-3, d.length - along);
        table.number("length_mm", section.length, {0.1, longest_device});
        along += section.length;
        read_ends(table, rigidity_keys, {1e-3, Limits::rigidity}, section.rigidity_distal,
                  section.rigidity_proximal);
        read_ends(table, torsional_keys, {0, Limits::rigidity}, section.torsional_distal,
                  section.torsional_proximal);
        table.finish();
    }
    if (along > d.length + 1e-9)
        top.refuse_whole(
            fmt::format("expected sections of up to the device's {:g} mm, found {:g} mm", d.length, along));
    given.emplace_back("section");
}

void read_shape(io::Section& top, Device& d, std::vector<std::string>& given) {
    for (io::Section& arc : top.sections("shape")) {
        physics::RestArc& piece = d.shape.emplace_back();
        if (!arc.find("length_mm")) arc.missing("length_mm", "length_mm = ...");
        arc.number("length_mm", piece.length, {0.1, 300});
        arc.number("angle_deg", piece.angle, {-720, 720}, geometry::degree);
        arc.number("plane_deg", piece.plane, {-180, 180}, geometry::degree);
        arc.finish();
    }
    if (!d.shape.empty()) given.emplace_back("shape");
}

/// A look as wide as the device, and no part of it wider or longer.
void fit_look(Device& d) {
    d.look.diameter = d.outer_diameter;
    d.look.inner_diameter = d.inner_diameter;
    d.look.core_diameter = std::min(d.look.core_diameter, d.outer_diameter);
    if (const auto stiffness = tip_and_shaft(d); stiffness && d.kind == DeviceKind::Wire)
        d.look.marker_length = std::min(d.look.marker_length, stiffness->tip_length);
}

/// What the device is made of; a wire without a look is a steel one with a platinum coil at its tip.
void read_look(io::Section look, Device& d, std::vector<std::string>& given) {
    render::WireLook& seen = d.look;
    fit_look(d);
    if (has_lumen(d.kind)) {
        seen.body = render::Material::BariumPolymer;
        seen.marker = render::Material::TungstenPolymer;
        seen.marker_length = 3;
        seen.marker_fill = 1;
    }
    if (!look.given()) return;
    std::vector<std::string_view> names;
    for (int k = 0; k < render::material_count; ++k)
        names.push_back(render::name_of(static_cast<render::Material>(k)));
    const auto material = [&](const char* key, render::Material& value) {
        if (const auto which = look.choice(key, names)) value = static_cast<render::Material>(*which);
    };
    material("body", seen.body);
    material("marker", seen.marker);
    material("core", seen.core);
    look.number("body_fill", seen.body_fill, {0, 1});
    look.number("marker_fill", seen.marker_fill, {0, 1});
    look.number("marker_length_mm", seen.marker_length, {0, 500});
    look.number("core_diameter_mm", seen.core_diameter, {0, d.outer_diameter});
    look.finish();
    given.emplace_back("look");
}

void read_sources(io::Section sources, const std::vector<std::string>& given, Device& d) {
    // Of a key of [balloon] in [sources.balloon].
    for (const std::string_view part : {"", "balloon", "stent"}) {
        std::vector<std::pair<const std::string*, std::string_view>>
            keys;  // and what it is called in the part
        for (const std::string& key : given) {
            const std::size_t dot = std::min(key.find('.'), key.size());
            const std::string_view of = dot < key.size() ? std::string_view(key).substr(0, dot) : "";
            if (of == part) keys.emplace_back(&key, std::string_view(key).substr(of.empty() ? 0 : dot + 1));
        }
        if (keys.empty()) continue;
        std::optional<io::Section> nested;
        if (!part.empty()) nested.emplace(sources.section(part, true));
        io::Section& section = nested ? *nested : sources;
        for (const auto& [key, name] : keys)
            if (!section.word(name, d.sources[*key]))
                section.missing(
                    name,
                    fmt::format("'{}', the source of the value, or 'estimate: …' with its reason,", name));
        if (nested) nested->finish();
    }
    sources.finish();
}

}  // namespace

std::string_view name_of(DeviceKind kind) {
    return kinds[static_cast<std::size_t>(kind)];
}

std::string names_of(std::span<const DeviceKind> of) {
    std::vector<std::string_view> names;
    for (const DeviceKind kind : of) names.push_back(name_of(kind));
    return io::joined(names, " or ");
}

namespace {

/// What a wire or a plain catheter has none of.
struct Treatment {
    std::optional<Balloon> balloon;
    std::optional<Stent> stent;
    double wire_lumen = 0;
    void state(geometry::StateStream& s) { s(balloon, stent, wire_lumen); }
};

}  // namespace

void Device::state(geometry::StateStream& s) {
    DeviceSpec::state(s);
    // The hashes of wires and catheters are those of before there were balloons.
    std::vector<Treatment> treatment;
    if (balloon || stent || wire_lumen != 0) treatment.push_back({balloon, stent, wire_lumen});
    s.unless_empty(treatment);
    if (!s.restores()) return;
    const Treatment read = treatment.empty() ? Treatment() : treatment.front();
    balloon = read.balloon;
    stent = read.stent;
    wire_lumen = read.wire_lumen;
}

Device parse_device(const std::string& text, const std::filesystem::path& file) {
    io::ParseContext reading{file.string(), {}, {}};
    Device d;
    d.name = file.stem().string();
    const toml::table root = reading.parse(text);
    io::Section top(reading, &root, "");
    top.schema();
    if (!top.word("title", d.title)) top.missing("title", "title");
    if (!top.find("kind")) top.missing("kind", "kind = " + io::joined(kinds, ", "));
    if (const auto kind = top.choice("kind", kinds)) d.kind = static_cast<DeviceKind>(*kind);
    std::vector<std::string> given;
    top.number("length_mm", d.length, io::Range{100, longest_device});
    read_sections(top, d, given);
    read_values(top, d, given);
    read_shape(top, d, given);
    read_look(top.section("look", false), d, given);
    read_treatment(top, d, given);
    read_sources(top.section("sources", true), given, d);
    top.finish();
    if (d.inner_diameter >= d.outer_diameter)
        top.refuse_whole(fmt::format("a lumen of {:g} mm in a device of {:g} mm; expected a narrower one",
                                     d.inner_diameter, d.outer_diameter));
    if (physics::shaped_length(d) > d.length)
        top.refuse_whole(
            fmt::format("a shape {:g} mm long at the end of a device of {:g} mm; expected a shorter one",
                        physics::shaped_length(d), d.length));
    reading.end();
    if (const auto wrong = physics::problems(d); !wrong.empty())
        throw io::InputError("{}: {}", file.string(), io::joined(wrong, " "));
    return d;
}

void override_device(io::Section& section, Device& d) {
    std::optional<TipAndShaft> stiffness = tip_and_shaft(d);
    each_value(d, stiffness ? &*stiffness : nullptr,
               [&](const char* key, double& value, io::Range range) { section.number(key, value, range); });
    if (stiffness) set_stiffness(d, *stiffness);
    // A static value is that of its kinetic one, and goes with it.
    each_friction(d, [&](const FrictionPair& f) {
        if (section.find(f.key)) f.still = 0;
    });
    each_further_value(
        d, [&](const char* key, double& value, io::Range range) { section.number(key, value, range); });
    check_static_values(section, d);
    // A wire has one diameter.
    if (d.kind == DeviceKind::Wire)
        section.number("diameter_mm", d.outer_diameter, {0.05, physics::DeviceLimits::diameter});
    fit_look(d);
    const toml::node *length = section.find("curved_length_mm"), *angle = section.find("curved_angle_deg");
    if (length || angle) {
        physics::RestArc bend = d.shape.size() == 1 ? d.shape.front() : physics::RestArc();
        section.number("curved_length_mm", bend.length, {0, longest_bend});
        section.number("curved_angle_deg", bend.angle, {-most_bend, most_bend}, geometry::degree);
        if (d.shape.size() > 1)
            section.refuse(
                length ? "curved_length_mm" : "curved_angle_deg", *(length ? length : angle),
                fmt::format("expected a device of one bend, found one of {} arcs", d.shape.size()));
        d.shape.clear();
        if (bend.length > 0 && bend.angle != 0) d.shape.push_back(bend);
    }
    const toml::node* smooth = section.find("frictionless");
    bool frictionless = false;
    section.flag("frictionless", frictionless);
    if (!frictionless) return;
    each_friction(d, [&](const FrictionPair& f) {
        for (const char* key : {f.key, f.static_key})
            if (section.find(key))
                section.refuse("frictionless", *smooth,
                               fmt::format("expected '{}' or 'frictionless = true', found both", key));
        f.slides = f.still = 0;
    });
}

Device load_device(const std::filesystem::path& path) {
    return parse_device(io::read_text(path, "device", "expected a .toml file"), path);
}

std::vector<std::filesystem::path> device_files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        if (entry.path().extension() == ".toml") files.push_back(entry.path());
    std::ranges::sort(files);
    return files;
}

std::filesystem::path find_device(const std::string& path_or_name, const std::filesystem::path& folder,
                                  std::span<const DeviceKind> of) {
    if (path_or_name.ends_with(".toml")) return path_or_name;
    std::vector<std::string> names;
    for (const std::filesystem::path& file : device_files(folder)) {
        if (file.stem() == path_or_name) return file;
        if (of.empty() || std::ranges::count(of, load_device(file).kind) > 0)
            names.push_back(file.stem().string());
    }
    const std::vector<std::string_view> known(names.begin(), names.end());
    std::vector<std::string> plurals;
    for (const DeviceKind kind : of) plurals.push_back(fmt::format("{}s", name_of(kind)));
    throw io::InputError("expected a {} of the catalogue or a file (.toml), found '{}'{}; {} are: {}",
                         of.empty() ? "device" : names_of(of), path_or_name,
                         io::suggestion(path_or_name, known),
                         of.empty() ? "devices" : io::joined(plurals, " and "), io::joined(names));
}

std::optional<TipAndShaft> tip_and_shaft(const physics::DeviceSpec& d) {
    const auto same = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(a); };
    const std::vector<physics::StiffnessSection>& list = d.sections;
    if (list.empty()) return std::nullopt;
    const physics::StiffnessSection &first = list.front(), &shaft = list.back();
    TipAndShaft found;
    found.shaft_rigidity = shaft.rigidity_proximal;
    found.torsional_rigidity = shaft.torsional_proximal;
    found.tip_rigidity = first.rigidity_distal;
    const double fraction = found.torsional_rigidity / found.shaft_rigidity;
    for (const physics::StiffnessSection& s : list) {
        const bool even = same(s.rigidity_distal, s.rigidity_proximal);
        if (&s == &shaft ? !even : even ? &s != &first : !same(s.rigidity_distal, found.tip_rigidity))
            return std::nullopt;
        if (!same(s.torsional_distal, fraction * s.rigidity_distal) ||
            !same(s.torsional_proximal, fraction * s.rigidity_proximal))
            return std::nullopt;
        if (&s == &shaft) continue;
        if (!even && (&s != &shaft - 1 || !same(s.rigidity_proximal, found.shaft_rigidity)))
            return std::nullopt;
        (even ? found.tip_length : found.transition_length) = s.length;
    }
    return found;
}

void set_stiffness(physics::DeviceSpec& d, const TipAndShaft& s) {
    d.sections = physics::soft_tip(s.tip_rigidity, s.tip_length, s.transition_length, s.shaft_rigidity,
                                   s.torsional_rigidity);
}

double largest_curvature(const Device& d) {
    double most = 0;
    for (const physics::RestArc& arc : d.shape) most = std::max(most, std::abs(arc.angle) / arc.length);
    return most;
}

double usual_segment_length(const Device& d) {
    constexpr double thin = 0.6, most_turn = 0.6;  // [mm]; of a joint at rest [rad]
    const double by_width = d.outer_diameter < thin ? 1 : 2, bend = largest_curvature(d);
    return bend > 0 ? std::min(by_width, most_turn / bend) : by_width;
}

Polyline free_shape(const Device& d, double straight) {
    // From the shaft to the distal end the arcs come in reverse.
    Vec3 at(0, 0, 0), along = Vec3::UnitX(), aside = Vec3::UnitY();
    Polyline line = {at, at + straight * along};
    at = line.back();
    for (auto arc = d.shape.rbegin(); arc != d.shape.rend(); ++arc) {
        const Vec3 turned = geometry::rotation(arc->plane, along) * aside;
        const Vec3 axis = along.cross(turned);
        constexpr double finest = 4 * geometry::degree;
        const int steps = std::max(static_cast<int>(std::ceil(arc->length)),
                                   static_cast<int>(std::ceil(std::abs(arc->angle) / finest)));
        const double step = arc->length / steps, turn = arc->angle / steps;
        // A chord of the arc, half of its turn before and half after.
        const double chord = turn == 0 ? step : 2 * step / turn * geometry::sin(0.5 * turn);
        for (int k = 0; k < steps; ++k) {
            at += chord * (geometry::rotation(0.5 * turn, axis) * along);
            const geometry::Mat3 whole = geometry::rotation(turn, axis);
            along = whole * along;
            aside = whole * aside;
            line.push_back(at);
        }
    }
    return line;
}

}  // namespace scenario
