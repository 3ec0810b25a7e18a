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

int show(const DeviceArguments& arguments) {
    if (!arguments.out.empty()) io::require_writable(arguments.out);
    const std::filesystem::path file = scenario::find_device(arguments.name, assets() / "devices");
    io::require_distinct(std::array{io::Output{"--out", arguments.out}}, std::array{file});
    const scenario::Device d = scenario::load_device(file);
    const bool catheter = d.kind == scenario::DeviceKind::Catheter;
    const auto line = [&](const char* name, const char* key, const std::string& value) {
        const auto source = d.sources.find(key);
        print("{:<22} {:<18} {}\n", name, value, source == d.sources.end() ? "" : source->second);
    };
    print("{}: {}, {}\n", d.name, catheter ? "catheter" : "wire", d.title);
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
                                              "Wires and catheters of the catalogue\n\n"
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
                     "Picture of its free shape, EI along it and cross-section (.png)")
        ->type_name("FILE")
        ->check(picture_name());
    return {command, [arguments] { return show(*arguments); }};
}

}  // namespace app
