#include "engine/scenario/device.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <toml++/toml.h>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/plot.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"

namespace scenario {
namespace {

using geometry::Polyline;
using geometry::Vec3;

constexpr double longest_device = 3500;  // [mm]
constexpr std::string_view kinds[] = {"wire", "catheter"};

io::Range up_to(double most) {
    return {0, most};
}

/// Calls number(key, value, range) for each number of a device.
template <class Number>
void each_value(Device& d, const Number& number) {
    using Limits = physics::WireLimits;
    number("length_mm", d.length, io::Range{100, longest_device});
    number("outer_diameter_mm", d.outer_diameter, io::Range{0.05, Limits::diameter});
    if (d.kind == DeviceKind::Catheter)
        number("inner_diameter_mm", d.inner_diameter, io::Range{0.05, Limits::diameter});
    number("shaft_rigidity_N_mm2", d.shaft_rigidity, io::Range{1e-3, Limits::rigidity});
    number("tip_rigidity_N_mm2", d.tip_rigidity, io::Range{1e-3, Limits::rigidity});
    number("tip_length_mm", d.tip_length, up_to(Limits::soft_length));
    number("transition_length_mm", d.transition_length, up_to(Limits::soft_length));
    number("torsional_rigidity_N_mm2", d.torsional_rigidity, up_to(Limits::rigidity));
    number("friction", d.friction, up_to(Limits::friction));
    number("buckling_force_N", d.buckling_force, up_to(Limits::buckling_force));
}

/// The keys that need a source.
void read_values(io::Section& top, Device& d, std::vector<std::string>& given) {
    each_value(d, [&](const char* key, double& value, io::Range range) {
        if (!top.find(key))
            top.missing(key, std::string(key) + " = ...");
        else
            given.emplace_back(key);
        top.number(key, value, range);
    });
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

/// What the device is made of; a wire without a look is a steel one with a platinum coil at its tip.
void read_look(io::Section look, Device& d, std::vector<std::string>& given) {
    render::WireLook& seen = d.look;
    seen.diameter = d.outer_diameter;
    seen.inner_diameter = d.inner_diameter;
    seen.marker_length = std::min(seen.marker_length, d.tip_length);
    if (d.kind == DeviceKind::Catheter) {
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
    for (const std::string& key : given) {
        std::string& source = d.sources[key];
        if (!sources.word(key, source))
            sources.missing(key, "the source of the value, or 'estimate: …' with its reason");
    }
    sources.finish();
}

std::string quoted(const std::string& text) {
    std::string result;
    for (const char c : text)
        result += c == '"' || c == '\\' || static_cast<unsigned char>(c) < ' ' ? '\'' : c;
    return result;
}

}  // namespace

Device parse_device(const std::string& text, const std::filesystem::path& file) {
    io::Reading reading{file.string(), {}, {}};
    Device d;
    d.name = file.stem().string();
    const toml::table root = reading.parse(text);
    io::Section top(reading, &root, "");
    top.schema();
    if (!top.word("title", d.title)) top.missing("title", "title");
    if (!top.find("kind")) top.missing("kind", "kind = \"wire\" or \"catheter\"");
    if (const auto kind = top.choice("kind", kinds)) d.kind = static_cast<DeviceKind>(*kind);
    std::vector<std::string> given;
    read_values(top, d, given);
    read_shape(top, d, given);
    read_look(top.section("look", false), d, given);
    read_sources(top.section("sources", true), given, d);
    top.finish();
    if (d.inner_diameter >= d.outer_diameter)
        top.refuse_whole(fmt::format("a lumen of {:g} mm in a device of {:g} mm; a narrower one is accepted",
                                     d.inner_diameter, d.outer_diameter));
    if (physics::shaped_length(d) > d.length)
        top.refuse_whole(
            fmt::format("a shape {:g} mm long at the end of a device of {:g} mm; a shorter one is accepted",
                        physics::shaped_length(d), d.length));
    reading.end();
    return d;
}

void override_device(io::Section& section, Device& d) {
    each_value(d,
               [&](const char* key, double& value, io::Range range) { section.number(key, value, range); });
}

Device load_device(const std::filesystem::path& path) {
    return parse_device(io::read_text(path, "device", "a .toml file is accepted"), path);
}

std::vector<std::filesystem::path> device_files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
        if (entry.path().extension() == ".toml") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

std::filesystem::path find_device(const std::string& path_or_name, const std::filesystem::path& folder) {
    std::error_code error;
    if (path_or_name.ends_with(".toml")) return path_or_name;
    std::vector<std::string> names;
    for (const std::filesystem::path& file : device_files(folder)) {
        if (file.stem() == path_or_name) return file;
        names.push_back(file.stem().string());
    }
    throw io::InputError(fmt::format("'{}' is no device; a file (.toml) or one of these is accepted: {}",
                                     path_or_name, io::joined(names)));
}

physics::GuidewireSpec guidewire_of(const Device& d) {
    if (d.kind != DeviceKind::Wire)
        throw io::InputError(fmt::format("'{}' is a catheter; a wire is accepted", d.name));
    if (d.shape.size() > 1)
        throw io::InputError(
            fmt::format("the wire '{}' has {} arcs; one is accepted", d.name, d.shape.size()));
    physics::GuidewireSpec spec;
    constexpr double thin = 0.6, most_turn = 0.6;  // [mm]; of a joint at rest [rad]
    spec.segment_length = d.outer_diameter < thin ? 1 : 2;
    if (!d.shape.empty() && d.shape[0].angle != 0)
        spec.segment_length =
            std::min(spec.segment_length, most_turn * d.shape[0].length / std::abs(d.shape[0].angle));
    spec.diameter = d.outer_diameter;
    spec.shaft_rigidity = d.shaft_rigidity;
    spec.tip_rigidity = d.tip_rigidity;
    spec.tip_length = d.tip_length;
    spec.transition_length = d.transition_length;
    spec.curved_length = d.shape.empty() ? 0 : d.shape[0].length;
    spec.curved_angle = d.shape.empty() ? 0 : d.shape[0].angle;
    spec.torsional_rigidity = d.torsional_rigidity;
    spec.friction = d.friction;
    spec.buckling_force = d.buckling_force;
    return spec;
}

Polyline free_shape(const Device& d, double straight) {
    // From the shaft to the distal end the arcs come in reverse.
    Vec3 at(0, 0, 0), along = Vec3::UnitX(), aside = Vec3::UnitY();
    Polyline line = {at, at + straight * along};
    at = line.back();
    for (auto arc = d.shape.rbegin(); arc != d.shape.rend(); ++arc) {
        const Vec3 turned = Eigen::AngleAxisd(arc->plane, along) * aside;
        const Vec3 axis = along.cross(turned);
        constexpr double finest = 4 * geometry::degree;
        const int steps = std::max(static_cast<int>(std::ceil(arc->length)),
                                   static_cast<int>(std::ceil(std::abs(arc->angle) / finest)));
        const double step = arc->length / steps, turn = arc->angle / steps;
        // A chord of the arc, half of its turn before and half after.
        const double chord = turn == 0 ? step : 2 * step / turn * std::sin(0.5 * turn);
        for (int k = 0; k < steps; ++k) {
            at += chord * (Eigen::AngleAxisd(0.5 * turn, axis) * along);
            const Eigen::AngleAxisd whole(turn, axis);
            along = whole * along;
            aside = whole * aside;
            line.push_back(at);
        }
    }
    return line;
}

void draw_device(const Device& d, const std::filesystem::path& png) {
    if (png.extension() != ".png")
        throw io::InputError(png.string() + ": a file name that ends in .png is accepted");
    const io::ScratchFolder scratch;
    std::string shape, stiffness;
    for (const Vec3& p : free_shape(d, std::max(15.0, 0.4 * physics::shaped_length(d))))
        shape += fmt::format("{},{},{}\n", p.x(), p.y(), p.z());
    physics::GuidewireSpec material;
    material.shaft_rigidity = d.shaft_rigidity;
    material.tip_rigidity = d.tip_rigidity;
    material.tip_length = d.tip_length;
    material.transition_length = d.transition_length;
    const double shown = std::min(d.length, 2 * (d.tip_length + d.transition_length) + 50);
    for (int k = 0; k <= 400; ++k) {
        const double s = shown * k / 400;
        stiffness += fmt::format("{},{}\n", s, physics::rigidity_at(material, s));
    }
    io::write_whole(scratch.path() / "shape.csv", shape);
    io::write_whole(scratch.path() / "stiffness.csv", stiffness);
    const bool solid = std::none_of(d.shape.begin(), d.shape.end(),
                                    [](const physics::RestArc& arc) { return arc.plane != 0; });
    io::Plot plot{"device", "", 1000, 760};
    plot.commands = fmt::format(
        "set datafile separator ','\nset multiplot title \"{} – {}\" noenhanced\nset grid lc rgb '#dddddd'\n"
        "set size 0.62,0.9\nset origin 0.0,0.02\nset size ratio -1\nset offsets 6,6,6,6\nset xlabel "
        "'mm'\nset ylabel "
        "'mm'\nset title 'free shape{}'\n"
        "plot 'shape.csv' using 1:2 with lines lw {} lc rgb '#0072B2' notitle{}\n"
        "set size noratio\nset offsets 0,0,0,0\nset size 0.38,0.46\nset origin 0.61,0.46\nset logscale "
        "y\nset xlabel 'from "
        "the distal end [mm]'\nset ylabel 'EI [N mm^2]'\nset title 'EI along it'\n"
        "plot [][*:*] 'stiffness.csv' using 1:2 with lines lw 2 lc rgb '#D55E00' notitle\n"
        "unset logscale\nset size 0.38,0.46\nset origin 0.61,0.01\nset size ratio -1\nset xlabel 'mm'\nset "
        "ylabel ''\nset "
        "title 'cross-section of the shaft'\nset parametric\nset trange [0:2*pi]\nset xrange [{}:{}]\nset "
        "yrange [{}:{}]\n"
        "set object 1 circle at 0,0 size {} fillcolor rgb '#9db8cc' fillstyle solid border rgb '#0072B2'\n{}"
        "plot 0,0 with points pt 0 notitle\nunset multiplot\n",
        quoted(d.name), quoted(d.title), solid ? "" : ", seen across its first plane (dashed: from the side)",
        std::clamp(2 * d.outer_diameter, 1.5, 5.0),
        solid ? "" : ", 'shape.csv' using 1:3 with lines lw 1 dt 2 lc rgb '#777777' notitle",
        -d.outer_diameter, d.outer_diameter, -0.7 * d.outer_diameter, 0.7 * d.outer_diameter,
        0.5 * d.outer_diameter,
        d.inner_diameter > 0
            ? fmt::format("set object 2 circle at 0,0 size {} fillcolor rgb '#ffffff' fillstyle solid border "
                          "rgb '#0072B2' front\n",
                          0.5 * d.inner_diameter)
            : std::string());
    if (const std::string notice = io::write_plot(plot, scratch.path()); !notice.empty())
        throw io::InputError("no picture of " + d.name + ": " + notice);
    io::write_whole(
        png, io::read_text(scratch.path() / "device.png", "picture", "one that gnuplot drew is accepted"));
}

}  // namespace scenario
