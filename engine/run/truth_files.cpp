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
    Json places = Json::array(), pixels = Json::array();
    for (const geometry::Vec3& joint : pulse.joints) {
        const geometry::Vec3 place = joint + pulse.exposure.vessel_shift;
        const render::Pixel pixel = render::project(arm, place);
        places.push_back(list(place));
        pixels.push_back({pixel.x, pixel.y});
    }
    json["tip_mm"] = places.back();
    json["tip_px"] = pixels.back();
    const double x = pixels.back()[0], y = pixels.back()[1];
    json["tip_in_image"] = x >= open.left && y >= open.top && x < open.right && y < open.bottom;
    json["wire_mm"] = std::move(places);
    json["wire_px"] = std::move(pixels);
    json["wire_mask"] = stem(time.index) + "_wire.png";
    json["vessel_mask"] = stem(time.index) + "_vessels.png";
    return json.dump() + "\n";
}

void write_truth(const std::filesystem::path& folder, const exercise::Truth& truth,
                 const exercise::FrameTime& time) {
    write_picture(folder / (stem(time.index) + "_wire.png"), truth.wire);
    write_picture(folder / (stem(time.index) + "_vessels.png"), truth.vessels);
    io::write_whole(folder / (stem(time.index) + ".json"), to_json(truth, time));
}

}  // namespace run
