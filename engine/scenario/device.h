#pragma once
/// The device catalogue: wires, catheters, balloons and stents as files, every value with its source.

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "physics/wall/opening.h"
#include "physics/wire/device.h"
#include "render/xray/wire_image.h"

namespace io {
class Section;
}

namespace scenario {

enum class DeviceKind { Wire, Catheter, Balloon, Stent };
std::string_view name_of(DeviceKind);
/// All but wires are catheters: of a balloon, and one that carries a stent.
inline constexpr bool has_lumen(DeviceKind kind) {
    return kind != DeviceKind::Wire;
}

/// At the distal end of a catheter; distances along it.
struct Balloon {
    physics::BalloonLaw law;
    double length = 0;              // between its cones [mm]
    double cone = 0;                // length of each [mm]
    double from_tip = 0;            // of the device, to the distal end of `length` [mm]
    double nominal = 0, rated = 0;  // rated: up to which makers vouch that it does not burst [atm]
    double deflation = 0;           // time from nominal pressure until it is folded again [s]
    double rigidity = 0;            // EI that it adds when inflated [N·mm²]

    void state(geometry::StateStream& s) {
        s(law, length, cone, from_tip, nominal, rated, deflation, rigidity);
    }
};

/// On a balloon, or self-expanding, in a sheath around the catheter.
struct Stent {
    physics::StentLaw law;
    double length = 0;          // when expanded to `diameter` [mm]
    double diameter = 0;        // nominal, expanded [mm]
    double foreshortening = 0;  // loss of length from crimped to `diameter`, of the crimped length [-]
    double from_tip = 0;        // of the device, to the stent's distal end [mm]
    double strut = 0;           // thickness [mm]
    int crowns = 0;             // of a ring
    double pitch = 0;           // length of stent to a ring [mm]
    render::Material material = render::Material::Steel;

    void state(geometry::StateStream& s) {
        s(law, length, diameter, foreshortening, from_tip, strut, crowns, pitch, material);
    }
};

/// What it is made of, where it comes from and how it looks.
struct Device : physics::DeviceSpec {
    std::string name, title;  // of the file; one line
    DeviceKind kind = DeviceKind::Wire;
    render::WireLook look;           // in the beam
    std::optional<Balloon> balloon;  // of a balloon, and of a stent that one opens
    std::optional<Stent> stent;
    double wire_lumen = 0;                       // the wire's lumen, from the tip; 0 = all of it [mm]
    std::map<std::string, std::string> sources;  // by key; one that begins with "estimate" is an estimate

    /// Of what must pass: the shaft's diameter, or that of the folded balloon and its stent [mm].
    double widest() const {
        return balloon ? std::max(outer_diameter, balloon->law.profile) : outer_diameter;
    }
    void state(geometry::StateStream&);
};

/// λ of a chain around this wire where the scenario gives none: 1 mm for a thin one, 2 mm for others, and so
/// short that the unloaded tip bends by 0.6 rad at a joint at most [mm].
double usual_segment_length(const Device&);

/// A stiffness as most files state it: a tip of one EI, a transition along which it rises geometrically, and
/// a shaft; GJ is everywhere the same multiple of EI.
struct TipAndShaft {
    double shaft_rigidity = 0, tip_rigidity = 0;   // EI [N·mm²]
    double tip_length = 0, transition_length = 0;  // [mm]
    double torsional_rigidity = 0;                 // GJ of the shaft, 0 = rigid [N·mm²]
};
/// Empty for a device of other sections.
std::optional<TipAndShaft> tip_and_shaft(const physics::DeviceSpec&);
void set_stiffness(physics::DeviceSpec&, const TipAndShaft&);

/// The sharpest bend of the unloaded device [1/mm].
double largest_curvature(const Device&);

/// Throws InputError that lists everything wrong, a line each, with file:line:column: unknown keys, values
/// out of range, a lumen wider than the device, a shape longer than the device, a value without a source.
Device parse_device(const std::string& toml, const std::filesystem::path& file);
Device load_device(const std::filesystem::path&);
/// Reads those of a device's numbers that the section gives, without a source, and "frictionless = true".
void override_device(io::Section&, Device&);

/// Device files (*.toml) of a folder by name, in alphabetical order.
std::vector<std::filesystem::path> device_files(const std::filesystem::path& folder);

/// "balloon or stent".
std::string names_of(std::span<const DeviceKind>);
/// A path to a device file as it is, or the name of one in the folder. Throws InputError naming those there,
/// of these kinds where there are any.
std::filesystem::path find_device(const std::string& path_or_name, const std::filesystem::path& folder,
                                  std::span<const DeviceKind> kinds = {});
inline std::filesystem::path find_device(const std::string& path_or_name, const std::filesystem::path& folder,
                                         DeviceKind kind) {
    return find_device(path_or_name, folder, std::span(&kind, 1));
}

/// Centre line of the free shape in mm, from `straight` mm of shaft proximal of it to the distal end at the
/// end of the list; the shaft runs along +x, an arc in plane 0 turns to +y.
geometry::Polyline free_shape(const Device&, double straight = 60);

/// Draws free shape, EI along the device, its cross-section, and the diameter of its balloon over pressure as
/// a PNG file. Uses gnuplot. Throws InputError when the file cannot be written or gnuplot is not installed;
/// an existing file is then left unchanged.
void draw_device(const Device&, const std::filesystem::path& png);

}  // namespace scenario
