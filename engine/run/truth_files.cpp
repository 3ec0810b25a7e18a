#include "engine/run/truth_files.h"

#include <Eigen/Core>
#include <chrono>
#include <fmt/format.h>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/io/files.h"
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

constexpr double mm_per_level = 0.01;  // of lengths: up to 655 mm

std::string length_file(int frame, std::size_t layer) {
    return fmt::format("{}_length_{:02}.png", stem(frame), layer);
}

}  // namespace

bool is_truth_ending(const std::string& ending) {
    for (const char* known : {".json", "_wire.png", "_microcatheter.png", "_intermediate.png", "_balloon.png",
                              "_catheter.png", "_sheath.png", "_stent.png", "_vessels.png",
                              "_extravasation.png", "_signal.png", "_expected.png", "_labels.png"})
        if (ending == known) return true;
    return ending.starts_with("_length_") && ending.ends_with(".png");
}

std::string to_json(const exercise::Truth& truth, const exercise::FrameTime& time, int lengths_of) {
    const exercise::Pulse& pulse = truth.pulse;
    const render::CArm& arm = pulse.arm;
    Json json;
    json["schema"] = 1;
    json["frame"] = time.index;
    json["attempt_frame"] = time.attempt;
    json["time_s"] = time.seconds;
    json["pulse_of_frame"] = pulse.time.index;
    json["mode"] = script::name_of(pulse.mode);
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
    for (const auto& [name, filter] :
         {std::pair{"wedge", arm.wedge}, std::pair{"lung_shutter", arm.lung_shutter}})
        if (filter.is_in())
            json["filters"][name] = {{"edge_mm", filter.edge},
                                     {"angle_deg", filter.angle / geometry::degree}};
    const Eigen::Matrix<double, 3, 4> camera = render::camera_matrix(arm);
    for (int row = 0; row < 3; ++row)
        json["camera_matrix"].push_back({camera(row, 0), camera(row, 1), camera(row, 2), camera(row, 3)});
    json["vessel_shift_mm"] = list(pulse.exposure.vessel_shift);
    float pushed = 0;
    for (const Eigen::Vector3f& move : pulse.exposure.vessel_moves) pushed = std::max(pushed, move.norm());
    json["vessels_pushed_mm"] = pushed;
    const geometry::Vec3& shift = pulse.exposure.vessel_shift;
    if (const geometry::Polyline& device = pulse.tip_of(); !device.empty()) {
        const render::Pixel pixel = render::project(arm, device.back() + shift);
        json["tip_mm"] = list(device.back() + shift);
        json["tip_px"] = {pixel.x, pixel.y};
        json["tip_in_image"] =
            pixel.x >= open.left && pixel.y >= open.top && pixel.x < open.right && pixel.y < open.bottom;
    }
    for (const exercise::PulsedDevice& device : pulse.devices) {
        const std::string name(script::name_of(device.role));
        list_device(json, name, device.joints, pulse);
        json[name + "_mask"] = stem(time.index) + "_" + name + ".png";
    }
    for (const exercise::TrueLesion& lesion : truth.lesions)
        json["lesions"].push_back({{"branch", lesion.branch},
                                   {"along_mm", lesion.along},
                                   {"reference_radius_mm", lesion.reference},
                                   {"radius_mm", lesion.radius},
                                   {"stent_radius_mm", lesion.stent}});
    for (const exercise::TrueStent& stent : truth.placed_stents)
        json["stents"].push_back({{"device", stent.device},
                                  {"attached", stent.attached},
                                  {"proximal_mm", list(stent.proximal)},
                                  {"distal_mm", list(stent.distal)},
                                  {"radii_mm", stent.radii}});
    json["vessel_mask"] = stem(time.index) + "_vessels.png";
    if (truth.extravasation) json["extravasation_mask"] = stem(time.index) + "_extravasation.png";
    if (truth.stents) json["stent_mask"] = stem(time.index) + "_stent.png";
    const double per_level = quanta_per_level(arm, truth.dose);
    if (truth.signal)
        json["signal"] = {{"file", stem(time.index) + "_signal.png"}, {"quanta_per_level", per_level}};
    if (truth.expected)
        json["expected"] = {{"file", stem(time.index) + "_expected.png"}, {"quanta_per_level", per_level}};
    if (truth.labels)
        json["vessel_labels"] = {{"file", stem(time.index) + "_labels.png"}, {"branches", truth.branches}};
    if (lengths_of >= 0) {
        Json layers = Json::array();
        for (std::size_t k = 0; k < truth.lengths.size(); ++k)
            layers.push_back({{"name", truth.lengths[k].name},
                              {"material", render::name_of(truth.lengths[k].material)},
                              {"inside", render::name_of(truth.lengths[k].inside)},
                              {"file", length_file(lengths_of, k)}});
        json["layer_lengths"] = {{"mm_per_level", mm_per_level}, {"layers", std::move(layers)}};
    }
    return json.dump() + "\n";
}

namespace {

using Clock = std::chrono::steady_clock;
/// What may be spent after an interruption: the whole program has a second.
constexpr std::chrono::milliseconds a_moment(300);

/// The files of one frame's truth, none of which stay unless all are there.
class TruthFiles {
public:
    TruthFiles(std::filesystem::path folder, const std::atomic<std::int64_t>& deadline)
        : folder_(std::move(folder)), deadline_(deadline) {}
    /// Writes the file by `write`, unless it is too late.
    template <class Write>
    void add(const std::string& name, const Write& write) {
        if (late_ || (late_ = Clock::now().time_since_epoch().count() > deadline_)) return;
        write(folder_ / name);
        made_.push_back(folder_ / name);
    }
    void finish() {
        if (!late_) return;
        std::error_code ignored;
        for (const std::filesystem::path& file : made_) std::filesystem::remove(file, ignored);
    }

private:
    std::filesystem::path folder_;
    const std::atomic<std::int64_t>& deadline_;
    bool late_ = false;
    std::vector<std::filesystem::path> made_;
};

}  // namespace

TruthFolder::TruthFolder(std::filesystem::path folder, const exercise::TruthParts& parts)
    : folder_(std::move(folder)),
      parts_(parts),
      deadline_(std::make_shared<std::atomic<std::int64_t>>(std::numeric_limits<std::int64_t>::max())) {}

void TruthFolder::hurry() {
    *deadline_ = (Clock::now() + a_moment).time_since_epoch().count();
}

void TruthFolder::take(exercise::Exercise& exercise, const exercise::FrameTime& time) {
    const Clock::time_point start = Clock::now();
    exercise::TruthParts parts = parts_;
    const exercise::Pulse& pulse = *exercise.monitor()->last_pulse();
    const Pose pose{pulse.arm, pulse.exposure.vessel_shift, pulse.exposure.breath, pulse.exposure.beat,
                    pulse.exposure.drift};
    const bool new_pose = parts.lengths && !(pose_ && *pose_ == pose);
    parts.lengths = new_pose;
    auto truth = std::make_shared<exercise::Truth>(exercise.truth(parts));
    if (new_pose) {
        pose_ = pose;
        lengths_of_ = time.index;
        layers_.clear();
        for (const auto& layer : truth->lengths)
            layers_.push_back({layer.name, layer.material, layer.inside, {}});
    } else {
        truth->lengths = layers_;
    }
    slow_ = Clock::now() - start > a_moment;
    queue_.put([truth, time, new_pose, folder = folder_, lengths_of = lengths_of_, deadline = deadline_] {
        TruthFiles files(folder, *deadline);
        const auto add = [&](const std::string& name, const auto& picture) {
            files.add(name, [&](const std::filesystem::path& file) { write_picture(file, picture); });
        };
        const auto add_levels = [&](const std::string& name, const render::Field& values, double per_level) {
            files.add(name, [&](const std::filesystem::path& file) {
                write_picture(file, deep_picture(values, per_level));
            });
        };
        const auto name = [&](const std::string& what) { return stem(time.index) + what; };
        add(name("_vessels.png"), truth->vessels);
        if (truth->extravasation) add(name("_extravasation.png"), *truth->extravasation);
        if (truth->stents) add(name("_stent.png"), *truth->stents);
        for (std::size_t k = 0; k < truth->devices.size(); ++k)
            add(name(fmt::format("_{}.png", script::name_of(truth->pulse.devices[k].role))),
                truth->devices[k]);
        const double per_level = quanta_per_level(truth->pulse.arm, truth->dose);
        if (truth->signal) add_levels(name("_signal.png"), *truth->signal, per_level);
        if (truth->expected) add_levels(name("_expected.png"), *truth->expected, per_level);
        if (truth->labels) add(name("_labels.png"), *truth->labels);
        for (std::size_t k = 0; new_pose && k < truth->lengths.size(); ++k)
            add_levels(length_file(lengths_of, k), truth->lengths[k].length, mm_per_level);
        files.add(name(".json"), [&](const std::filesystem::path& file) {
            io::write_whole(file, to_json(*truth, time, lengths_of));
        });
        files.finish();
    });
}

void TruthFolder::finish() {
    queue_.finish();
}

}  // namespace run
