#include "engine/run/truth_files.h"

#include <Eigen/Core>
#include <nlohmann/json.hpp>

#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/run/frame_sink.h"
#include "engine/run/picture_file.h"
#include "physics/geometry/vec.h"

namespace run {
namespace {

using Json = nlohmann::ordered_json;

Json list(const geometry::Vec3& v) {
    return {v.x(), v.y(), v.z()};
}

/// Joints of a device that is in, in the room and in the image.
void list_device(Json& json, const std::string& name, const geometry::Polyline& joints,
                 const exercise::Pulse& pulse) {
    Json places = Json::array(), pixels = Json::array();
    for (const geometry::Vec3& joint : joints) {
        const geometry::Vec3 place = joint + pulse.exposure.vessel_shift;
        const render::Pixel pixel = render::project(pulse.arm, place);
        places.push_back(list(place));
        pixels.push_back({pixel.x, pixel.y});
    }
    json[name + "_mm"] = std::move(places);
    json[name + "_px"] = std::move(pixels);
}

std::string stem(int frame) {
    return std::filesystem::path(frame_file_name(frame)).stem().string();
}

}  // namespace

std::string to_json(const exercise::Truth& truth, const exercise::FrameTime& time) {
    const exercise::Pulse& pulse = truth.pulse;
    const render::CArm& arm = pulse.arm;
    Json json;
    json["schema"] = 1;
    json["frame"] = time.index;
    json["attempt_frame"] = time.attempt;
    json["time_s"] = time.seconds;
    json["pulse_of_frame"] = pulse.time.index;
    json["mode"] = script::imaging_modes[static_cast<std::size_t>(pulse.mode)];
    json["image"] = {{"width", arm.pixels}, {"height", arm.pixels}};
    json["c_arm"] = {{"lao_deg", arm.lao / geometry::degree},
                     {"cranial_deg", arm.cranial / geometry::degree},
                     {"sid_mm", arm.sid},
                     {"sod_mm", arm.sod},
                     {"isocentre_mm", list(arm.isocentre)},
                     {"detector_width_mm", arm.detector_width},
                     {"source_mm", list(render::source(arm))}};
    const render::PixelBox open = render::opening_of(arm);
    json["collimator_px"] = {open.left, open.top, open.right, open.bottom};
    const Eigen::Matrix<double, 3, 4> camera = render::camera_matrix(arm);
    for (int row = 0; row < 3; ++row)
        json["camera_matrix"].push_back({camera(row, 0), camera(row, 1), camera(row, 2), camera(row, 3)});
    json["vessel_shift_mm"] = list(pulse.exposure.vessel_shift);
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    if (const geometry::Polyline& device = pulse.tip_of(); !device.empty()) {
        const render::Pixel pixel = render::project(arm, device.back() + shift);
        json["tip_mm"] = list(device.back() + shift);
        json["tip_px"] = {pixel.x, pixel.y};
        json["tip_in_image"] =
            pixel.x >= open.left && pixel.y >= open.top && pixel.x < open.right && pixel.y < open.bottom;
    }
    list_device(json, "wire", pulse.joints, pulse);
    json["wire_mask"] = stem(time.index) + "_wire.png";
    if (truth.catheter) {
        list_device(json, "catheter", pulse.catheter, pulse);
        json["catheter_mask"] = stem(time.index) + "_catheter.png";
    }
    json["vessel_mask"] = stem(time.index) + "_vessels.png";
    return json.dump() + "\n";
}

void write_truth(const std::filesystem::path& folder, const exercise::Truth& truth,
                 const exercise::FrameTime& time) {
    write_picture(folder / (stem(time.index) + "_wire.png"), truth.wire);
    write_picture(folder / (stem(time.index) + "_vessels.png"), truth.vessels);
    if (truth.catheter) write_picture(folder / (stem(time.index) + "_catheter.png"), *truth.catheter);
    io::write_whole(folder / (stem(time.index) + ".json"), to_json(truth, time));
}

}  // namespace run
