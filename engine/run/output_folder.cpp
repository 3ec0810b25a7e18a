#include "engine/run/output_folder.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <utility>

#include "engine/exercise/imaging.h"
#include "engine/io/error.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/picture_file.h"
#include "engine/run/slicer_markups.h"
#include "engine/run/truth_files.h"
#include "physics/geometry/hash.h"

namespace run {
namespace {

dicom::Radiation radiation_of(script::ImagingMode mode) {
    return script::acquires(mode) ? dicom::Radiation::Acquisition : dicom::Radiation::Fluoroscopy;
}

namespace fs = std::filesystem;

constexpr const char* own_files[] = {"run.gw", "score.json", "sheet.png"};
constexpr const char* frame_folders[] = {"frames", "panel", "truth", "dicom", "slicer"};

/// Whether the file is an angiogram, a markup, or named frame_000123 with one of the endings that are written
/// here.
bool is_of_a_run(const fs::path& file) {
    const std::string name = file.filename().string(), stem = name.substr(0, frame_file_name(0).size() - 4);
    const std::string ending = name.substr(stem.size());
    if (is_angiogram_file_name(name) || is_markup_name(name)) return true;
    return frame_of_file_name(stem + ".png") >= 0 && (ending == ".png" || is_truth_ending(ending));
}

void take_out(const fs::path& file) {
    std::error_code error;
    fs::remove(file, error);
    if (error) throw io::InputError("{}: cannot be replaced: {}", file.string(), error.message());
}

}  // namespace

std::uint64_t study_of(const script::Origin& origin, const script::CommandScript& script) {
    geometry::Hash hash;
    const auto add = [&](const std::string& text) {
        hash.add(static_cast<std::uint64_t>(text.size()));
        hash.add(text.data(), text.size());
    };
    for (const std::string* text : {&origin.program, &origin.scenario, &origin.learner}) add(*text);
    hash.add(origin.scenario_hash);
    hash.add(origin.anatomy_hash);
    for (const script::TimedCommand& timed : script.commands) {
        hash.add(static_cast<std::uint64_t>(timed.frame));
        add(script::to_text(timed.command));
    }
    return hash.value();
}

std::string angiogram_file_name(int number) {
    return fmt::format("xa_{:04}.dcm", number);
}

bool is_angiogram_file_name(const std::string& name) {
    if (!name.starts_with("xa_") || !name.ends_with(".dcm") || name.size() <= 7) return false;
    const auto number = io::parse_integer(std::string_view(name).substr(3, name.size() - 7));
    return number && *number > 0 && angiogram_file_name(*number) == name;
}

AngiogramFolder::AngiogramFolder(std::filesystem::path folder, dicom::Pixels pixels, dicom::Identity identity,
                                 const script::Origin& origin, const script::CommandScript& script, int every)
    : folder_(std::move(folder)),
      pixels_(pixels),
      identity_(std::move(identity)),
      origin_(origin),
      script_(script),
      study_(study_of(origin, script)),
      every_(every) {}

/// Iodine of the agent that was injected last [mg/ml]; none where contrast was there without an injection.
std::optional<double> AngiogramFolder::agent_at(int frame) const {
    std::optional<double> iodine;
    for (const script::TimedCommand& timed : script_.commands) {
        if (timed.frame > frame) break;
        if (const auto* inject = std::get_if<script::Inject>(&timed.command)) iodine = inject->iodine;
        if (std::holds_alternative<script::Reset>(timed.command)) iodine.reset();
    }
    return iodine;
}

bool AngiogramFolder::continues(const exercise::Frame& frame, const exercise::Pulse& pulse) const {
    if (!open_ || open_->is_full() || pulse.new_mask || pulse.mode != mode_) return false;
    if (!(pulse.arm == open_->series().arm) || pulse.time.attempt <= last_attempt_) return false;
    // A pedal that was released ends the stretch.
    const scenario::Scenario& scenario = frame.simulation.scenario();
    const double between = scenario.frame_rate / frame.simulation.console().pulse_rate();  // [frames]
    return pulse.time.index - last_pulse_ <= std::max(1.0, std::ceil(between)) + every_;
}

void AngiogramFolder::begin(const exercise::Frame& frame, const exercise::Pulse& pulse) {
    finish();
    const bool shown = pixels_ == dicom::Pixels::Shown, dsa = pulse.mode == script::ImagingMode::Dsa;
    dicom::Series series;
    series.identity = identity_;
    series.program = origin_.program;
    series.patient = origin_.scenario;
    series.subject = origin_.learner;
    series.study = study_;
    series.number = ++number_;
    series.description = fmt::format("{}, from frame {}", script::name_of(pulse.mode), frame.time.index);
    series.arm = pulse.arm;
    series.radiation = radiation_of(pulse.mode);
    series.pixels = pixels_;
    if (shown && dsa) series.derivation = "subtracted from the first image of its mask";
    if (shown && pulse.mode == script::ImagingMode::Roadmap)
        series.derivation = "opacified vessels laid under the image";
    series.first_is_mask = dsa;
    series.frame_rate = frame.simulation.console().pulse_rate() / every_;
    series.scale = 1 / quanta_per_level(pulse.arm, 1);
    mode_ = pulse.mode;
    open_.emplace(std::move(series));
}

void AngiogramFolder::finish() {
    if (open_ && open_->frames() > 0) open_->write(folder_ / angiogram_file_name(number_));
    open_.reset();
}

void AngiogramFolder::take(const exercise::Frame& frame, exercise::Monitor& monitor,
                           const render::GrayImage& shown) {
    const exercise::Pulse* const pulse = monitor.last_pulse();
    if (!pulse || pulse->time.index == last_pulse_) return;
    if (!continues(frame, *pulse)) begin(frame, *pulse);
    last_pulse_ = pulse->time.index;
    last_attempt_ = pulse->time.attempt;
    const render::Technique& technique = monitor.dose().last;
    if (exercise::has_contrast(pulse->exposure)) open_->inject(agent_at(frame.time.index));
    if (pixels_ == dicom::Pixels::Shown)
        open_->add(shown, technique, pulse->time.seconds);
    else
        open_->add(monitor.last_signal(), technique, pulse->time.seconds);
}

void refuse_to_overwrite(const fs::path& out, const fs::path& script,
                         const std::optional<fs::path>& expected) {
    if (io::same_file(out / "run.gw", script)) {
        throw io::InputError("{}: the run would overwrite its own commands; expected another output folder",
                             script.string());
    }
    if (expected && (io::same_file(out, *expected) || io::same_file(out / "run.gw", *expected))) {
        throw io::InputError(
            "{}: the run would overwrite what it is compared with; expected another output folder",
            expected->string());
    }
}

void refuse_to_replace(std::span<const fs::path> inputs, const fs::path& out, const fs::path& trace) {
    std::vector<io::Output> outputs;
    for (const char* name : own_files) outputs.push_back({"--out", out / name});
    if (!trace.empty()) outputs.push_back({"--trace", trace});
    io::require_distinct(outputs, inputs);
    for (const char* part : frame_folders) {
        const auto is_within = [&](const fs::path& file) {
            return io::same_file(file.parent_path().empty() ? "." : file.parent_path(), out / part) &&
                   is_of_a_run(file);
        };
        if (!trace.empty() && is_within(trace))
            throw io::InputError("--trace: {} is a file of the run's own; expected another file",
                                 trace.string());
        for (const fs::path& input : inputs)
            if (is_within(input) || io::same_file(input, out / part))
                throw io::InputError(
                    "--out: {} would be removed, and is read; expected another output folder",
                    input.string());
    }
}

OutputFolder::OutputFolder(fs::path path, Parts parts) : own_(path) {
    for (const char* name : own_files)
        if (std::error_code none; fs::is_directory(path / name, none))
            throw io::InputError("{}: cannot be written: a folder is in its place", (path / name).string());
    const std::pair<bool, const char*> wanted[] = {{parts.frames, "frames"},
                                                   {parts.panel, "panel"},
                                                   {parts.truth, "truth"},
                                                   {parts.dicom, "dicom"},
                                                   {parts.slicer, "slicer"}};
    for (const auto& [asked, name] : wanted)
        if (asked) own_.make(name);
}

void OutputFolder::take_out_earlier_run() const {
    for (const char* name : own_files) take_out(own_.path() / name);
    io::remove_leftovers(own_.path());
    for (const fs::path& folder : {frames(), panel(), truth(), dicom(), slicer()}) {
        std::vector<fs::path> old;
        std::error_code error;
        for (const auto& entry : fs::directory_iterator(folder, error))
            if (is_of_a_run(entry.path())) old.push_back(entry.path());
        for (const fs::path& file : old) take_out(file);
        io::remove_leftovers(folder);
    }
}

void OutputFolder::write_score(const std::string& json) const {
    io::write_whole(own_.path() / "score.json", json);
}

void OutputFolder::write_sheet(const render::GrayImage& page) const {
    write_picture(own_.path() / "sheet.png", page);
}

}  // namespace run
