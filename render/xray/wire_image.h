#pragma once
/// The shadow of wires and catheters: transmission per pixel, splatted analytically on the CPU.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/geometry/state.h"
#include "physics/geometry/vec.h"
#include "render/xray/c_arm.h"
#include "render/xray/materials.h"

namespace render {

/// A device: a solid cylinder, or a hollow one.
struct WireLook {
    double diameter = 0.889;               // 0.035 inch [mm]
    Material body = Material::Steel;       // of the shaft
    Material marker = Material::Platinum;  // of the distal coil
    double marker_length = 30.0;           // from the tip along the wire, 0 = none [mm]
    /// Fraction of the cross-section that is metal: coils and coatings are not solid. [-]
    double body_fill = 1.0;
    double marker_fill = 0.35;
    double inner_diameter = 0;  // of the bore; 0 = solid [mm]
    double core_diameter = 0;   // of a solid core inside body and marker; 0 = none [mm]
    Material core = Material::Nitinol;
    std::vector<double> bands =
        {};  // marker bands: from the tip to the middle of each, along the device [mm]

    /// A band is a ring of platinum around the device.
    static constexpr double band_length = 1, band_thickness = 0.05;  // [mm]

    bool operator==(const WireLook&) const = default;
    void state(geometry::StateStream& s) {
        s(diameter, body, marker, marker_length, body_fill, marker_fill, inner_diameter, core_diameter, core);
        s.unless_empty(bands);
    }
};

/// Iodine about a device [mg/ml]: in the blood that it displaces, Exposure::iodine aside, and in its bore,
/// the mean over the cross-section at equal parts of `length` [mm] from the hub to the end; empty = none.
struct DeviceIodine {
    double around = 0;
    std::vector<float> bore = {};
    double length = 0;

    bool operator==(const DeviceIodine&) const = default;
    void state(geometry::StateStream& s) { s(around, bore, length); }
};

/// A device in the beam.
struct SeenDevice {
    std::span<const geometry::Vec3> joints;  // from the introducer to its tip [mm]; empty = not there
    /// Of the device at each joint, in between linear, as of a balloon; empty = as its look says [mm]. The
    /// look then gives the bore as a fraction inner_diameter/diameter of it; one of 1 is a skin that is not
    /// seen itself. Its core_diameter, which does not vary, is that of what lies along its axis and is a
    /// device of its own: the bore is filled around it.
    std::span<const double> radii = {};
    const WireLook* look = nullptr;        // null = the fluoroscope's
    const DeviceIodine* iodine = nullptr;  // null = none
    bool straight = false;                 // between joints, as struts are; otherwise a spline
};
/// All of them, which lie in each other, innermost first.
struct SeenDevices {
    SeenDevices() = default;
    SeenDevices(std::span<const geometry::Vec3> wire) : all{{wire}} {}
    SeenDevices(const geometry::Polyline& wire) : all{{wire}} {}
    std::vector<SeenDevice> all;
};

/// Attenuation of the parts per energy bin, minus that of what they displace [1/mm].
struct WireAttenuation {
    Bins body{};
    Bins marker{};
    Bins core{};
    Bins band{};
};
/// What is cast of one device.
struct WireShadow {
    std::span<const geometry::Vec3> joints;
    WireLook look;
    WireAttenuation attenuation;
    const DeviceIodine* iodine = nullptr;  // of its bore, and around it in all; null = none
    std::span<const double> radii = {};    // as in SeenDevice
    bool straight = false;
};
WireAttenuation wire_attenuation(const WireLook&, const EnergyBins&, const Bins& displaced);

/// One pixel that the wire shadows.
struct WirePixel {
    std::uint32_t index = 0;                        // row · pixels + column
    std::array<float, energy_bins> transmission{};  // mean over the pixel's area
};

/// What makes shadows unsharp.
struct Unsharpness {
    double focal_spot = 0;  // side of the square that rays come from [mm]
    /// Way of the devices' shadow within the pulse, right and down [pixels].
    Eigen::Vector2d motion = Eigen::Vector2d::Zero();
};

/// Chords of rays through the swept wire, exact for a chain of cylinders, or of cones, mitred at the joints,
/// at 4 × 4 places of each pixel. Their transmissions are averaged: exp(−μ·mean chord) is wrong by up to 0.07
/// for steel. This is a class only to keep its scratch memory between frames; the result depends on the
/// arguments alone.
class WireImage {
public:
    static constexpr int samples = 4;  // along each side of a pixel

    /// Joints from the introducer to the tip [mm]. A wire with fewer than two joints or one that is not
    /// finite, or with radii of another number or not finite, or a part behind the source, casts no shadow.
    /// The result is valid until the next call.
    std::span<const WirePixel> cast(const CArm&, std::span<const geometry::Vec3> joints, const WireLook&,
                                    const WireAttenuation&);
    /// The same of several devices: their chords meet in one integral.
    /// What their bores hold attenuates by its iodine, `per_iodine` for a concentration [1/mm per mg/ml].
    /// A focal spot widens the square that a pixel's places cover to what the spot's shadow, by the depth of
    /// each piece, and the pixel have together; within the pulse, places are taken one after another.
    std::span<const WirePixel> cast(const CArm&, std::span<const WireShadow>, const Bins& per_iodine = {},
                                    const Unsharpness& = {});

private:
    static constexpr int per_pixel = samples * samples;
    enum Part { Body, Marker, Core };
    static constexpr int parts = 3;  // of a device
    using Places = std::array<float, per_pixel>;
    /// A pixel with some shadow.
    struct Slot {
        std::uint32_t pixel = 0;
        std::int32_t first = -1, last = -1;  // of its chords
        Places iodine{};                     // in bores [mg/ml·mm]
    };
    /// Chords [mm] of one device, or of its bands, at the places of one pixel.
    struct Chords {
        std::int32_t layer;
        std::int32_t next = -1;  // of the same pixel
        std::array<Places, parts> of{};
    };
    /// A device, or its bands, in the order of casting.
    struct Layer {
        WireAttenuation attenuation;
        bool cored;
    };
    struct Piece;
    struct Course;

    template <bool cone>
    void splat(const Piece&, int pixels, double scale);
    void splat_course(const CArm&, const Course&, Piece);
    void splat_device(const CArm&, const WireShadow&);
    Unsharpness unsharp_;
    Slot& slot(std::uint32_t pixel);
    /// Of the last layer.
    Chords& chords(Slot&);

    std::vector<std::int32_t> slot_of_pixel_;  // −1 where there is no wire
    std::vector<Slot> slots_;
    std::vector<Chords> chords_;
    std::vector<Layer> layers_;
    bool contents_ = false;  // some bore has others than the blood that the device displaces
    std::vector<WirePixel> result_;
};

}  // namespace render
