/// `seldinger device`.

#include <array>
#include <filesystem>
#include <fmt/format.h>
#include <memory>

#include "app/command.h"
#include "engine/io/files.h"
#include "engine/scenario/device.h"

namespace app {
namespace {

struct DeviceArguments {
    std::string name, out;
};

/// Calls line(name, key, value) for each value of balloon and stent.
template <class Line>
void print_treatment(const scenario::Device& d, const Line& line) {
    const auto in = [](double value, const char* unit) { return fmt::format("{:g}{}", value, unit); };
    if (d.wire_lumen > 0) line("wire's lumen", "wire_lumen_mm", in(d.wire_lumen, " mm from the tip"));
    if (d.balloon) {
        const scenario::Balloon& b = *d.balloon;
        line("balloon", "balloon.length_mm", in(b.length, " mm"));
        line("its cones", "balloon.cone_mm", in(b.cone, " mm"));
        line("its distal end", "balloon.from_tip_mm", in(b.from_tip, " mm from the tip"));
        line("folded", "balloon.profile_mm", in(b.law.profile, " mm"));
        for (const physics::BalloonLaw::Row& row : b.law.table)
            line("inflated", &row == &b.law.table.front() ? "balloon.compliance" : "",
                 fmt::format("{:g} mm, {:g} atm", row.diameter, row.pressure));
        line("nominal pressure", "balloon.nominal_atm", in(b.nominal, " atm"));
        line("rated pressure", "balloon.rated_atm", in(b.rated, " atm"));
        line("deflation", "balloon.deflation_s", in(b.deflation, " s"));
        line("EI when inflated", "balloon.inflated_rigidity_N_mm2", in(b.rigidity, " N mm2 more"));
    }
    if (d.stent) {
        const scenario::Stent& s = *d.stent;
        line("stent", "stent.self_expanding", s.law.self_expanding ? "self-expanding" : "on the balloon");
        line("its length", "stent.length_mm", in(s.length, " mm"));
        line("its diameter", "stent.diameter_mm", in(s.diameter, " mm"));
        line("at most", "stent.largest_diameter_mm", in(2 * s.law.free_radius, " mm"));
        line("foreshortening", "stent.foreshortening", in(100 * s.foreshortening, " %"));
        line("radial strength", "stent.radial_strength_atm", in(s.law.strength, " atm"));
        if (s.law.self_expanding) {
            line("presses outwards", "stent.outward_atm", in(s.law.outward, " atm"));
        } else {
            line("recoil", "stent.recoil", in(100 * s.law.recoil, " %"));
            line("opens at", "stent.opens_at_atm", in(s.law.opens_at, " atm"));
        }
        line("its distal end", "stent.from_tip_mm", in(s.from_tip, " mm from the tip"));
        line("struts", "stent.strut_mm", in(s.strut, " mm"));
        line("crowns of a ring", "stent.crowns", fmt::format("{}", s.crowns));
        line("a ring", "stent.pitch_mm", in(s.pitch, " mm long"));
        line("material", "stent.material", std::string(render::name_of(s.material)));
    }
}

int show(const DeviceArguments& arguments) {
    if (!arguments.out.empty()) io::require_writable(arguments.out);
    const std::filesystem::path file = scenario::find_device(arguments.name, assets() / "devices");
    io::require_distinct(std::array{io::Output{"--out", arguments.out}}, std::array{file});
    const scenario::Device d = scenario::load_device(file);
    const bool catheter = scenario::has_lumen(d.kind);
    const auto line = [&](const char* name, const char* key, const std::string& value) {
        const auto source = d.sources.find(key);
        print("{:<22} {:<18} {}\n", name, value, source == d.sources.end() ? "" : source->second);
    };
    print("{}: {}, {}\n", d.name, scenario::name_of(d.kind), d.title);
    line("length", "length_mm", fmt::format("{:g} mm", d.length));
    line("outer diameter", "outer_diameter_mm", fmt::format("{:g} mm", d.outer_diameter));
    if (catheter) line("lumen", "inner_diameter_mm", fmt::format("{:g} mm", d.inner_diameter));
    const auto stiffness = d.sources.contains("section") ? std::nullopt : scenario::tip_and_shaft(d);
    if (stiffness) {
        line("EI of the shaft", "shaft_rigidity_N_mm2", fmt::format("{:g} N mm2", stiffness->shaft_rigidity));
        line("EI of the tip", "tip_rigidity_N_mm2", fmt::format("{:g} N mm2", stiffness->tip_rigidity));
        line("floppy tip", "tip_length_mm", fmt::format("{:g} mm", stiffness->tip_length));
        line("transition", "transition_length_mm", fmt::format("{:g} mm", stiffness->transition_length));
        line("GJ of the shaft", "torsional_rigidity_N_mm2",
             fmt::format("{:g} N mm2", stiffness->torsional_rigidity));
    } else {
        for (const physics::StiffnessSection& s : d.sections)
            line("section, from the tip", "section",
                 fmt::format("{}, EI {:g} to {:g}, GJ {:g} to {:g} N mm2",
                             &s == &d.sections.back() ? "to the hub" : fmt::format("{:g} mm", s.length),
                             s.rigidity_distal, s.rigidity_proximal, s.torsional_distal,
                             s.torsional_proximal));
    }
    const auto held = [](double slides, double still, const char* unit) {
        return still > slides ? fmt::format("{:g}, still {:g}{}", slides, still, unit)
                              : fmt::format("{:g}{}", slides, unit);
    };
    line("friction", "friction", held(d.friction, d.static_friction, ""));
    if (d.holding_inner_friction() > 0)
        line("friction of its lumen", "inner_friction", held(d.inner_friction, d.static_inner_friction, ""));
    if (d.holding_valve_friction() > 0)
        line("friction of its valve", "valve_friction_N",
             held(d.valve_friction, d.static_valve_friction, " N"));
    line("buckling", "buckling_force_N", fmt::format("{:g} N", d.buckling_force));
    for (const physics::RestArc& arc : d.shape)
        line("shape, from the tip", "shape",
             fmt::format("{:g} mm, {:.0f} deg{}", arc.length, arc.angle / geometry::degree,
                         arc.plane != 0 ? fmt::format(", plane {:.0f}", arc.plane / geometry::degree) : ""));
    if (d.shape.empty()) print("{:<22} straight\n", "shape");
    print_treatment(d, line);
    if (!arguments.out.empty()) {
        scenario::draw_device(d, arguments.out);
        print("drawn in {}\n", arguments.out);
    }
    return done;
}

}  // namespace

Command add_device(CLI::App& parser) {
    const auto arguments = std::make_shared<DeviceArguments>();
    CLI::App* command = parser.add_subcommand("device",
                                              "Wires, catheters, balloons and stents of the catalogue\n\n"
                                              "Examples:\n"
                                              "  seldinger list devices\n"
                                              "  seldinger device show glide035 --out glide.png");
    command->require_subcommand(1);
    CLI::App* shown = command->add_subcommand("show",
                                              "Values of a device with their sources, and a picture of it\n\n"
                                              "Examples:\n"
                                              "  seldinger device show cobra5f\n"
                                              "  seldinger device show glide035 --out glide.png");
    shown
        ->add_option("name", arguments->name,
                     "A device of the catalogue ('seldinger list devices'), or a file (.toml)")
        ->required()
        ->type_name("DEVICE");
    shown
        ->add_option("--out", arguments->out,
                     "Picture of its free shape, EI along it, cross-section and balloon (.png)")
        ->type_name("FILE")
        ->check(picture_name());
    return {command, [arguments] { return show(*arguments); }};
}

}  // namespace app
