#include "engine/run/headless.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/exercise.h"
#include "engine/exercise/imaging.h"
#include "engine/exercise/observation.h"
#include "engine/exercise/room_readout.h"
#include "engine/exercise/score_file.h"
#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/run/output_folder.h"
#include "engine/run/picture_file.h"
#include "engine/run/slicer_markups.h"
#include "engine/run/truth_files.h"
#include "render/panel/contact_sheet.h"
#include "render/panel/panel.h"

namespace run {
namespace {

constexpr std::size_t most_differences = 5;

constexpr int sheet_tiles = 12, sheet_columns = 4, sheet_tile_width = 256;

/// Without `end`, a run continues after its last command long enough for the target's hold to pass.
int last_frame_of(const scenario::Scenario& scenario, const script::CommandScript& script) {
    return script.last_frame(static_cast<int>(std::ceil(scenario.target.hold * scenario.frame_rate)) + 1);
}

bool shows(int frame, int last, int every) {
    return frame % every == 0 || frame == last;
}

/// Frames with an image, about `sheet_tiles` of them evenly spaced, including the first and the last.
std::vector<int> sheet_frames(int last, int every) {
    std::vector<int> shown, chosen;
    for (int frame = 0; frame <= last; ++frame) {
        if (shows(frame, last, every)) shown.push_back(frame);
    }
    const int tiles = std::min<int>(sheet_tiles, static_cast<int>(shown.size()));
    for (int k = 0; k < tiles; ++k) {
        chosen.push_back(shown[tiles == 1 ? 0 : k * (shown.size() - 1) / (tiles - 1)]);
    }
    return chosen;
}

/// Collects the frames of the contact sheet and passes all frames on.
class Sheet {
public:
    Sheet(int last, int every, double frame_rate)
        : chosen_(sheet_frames(last, every)), frame_rate_(frame_rate) {}

    void accept(int frame, const render::GrayImage& image) {
        if (!std::ranges::binary_search(chosen_, frame)) return;
        images_.push_back(image);
        labels_.push_back(fmt::format("{} - {:.1f} s", frame, frame / frame_rate_));
    }
    std::optional<render::GrayImage> page() const {
        if (images_.empty()) return std::nullopt;
        return render::contact_sheet(images_, sheet_columns, sheet_tile_width, labels_);
    }

private:
    std::vector<int> chosen_;
    double frame_rate_;
    std::vector<render::GrayImage> images_;
    std::vector<std::string> labels_;
};

/// The files that a run leaves in its folder.
class FolderOutputs {
public:
    FolderOutputs(OutputFolder& folder, const RunOptions& options, int last, double frame_rate,
                  const exercise::Simulation& simulation, const script::CommandScript& script)
        : folder_(folder), sheet_(last, options.every, frame_rate) {
        if (!options.trace.empty()) {
            trace_.emplace(simulation);
            trace_file_.emplace(options.trace);
            trace_file_->append(exercise::Trace::header());
        }
        if (options.slicer) markups_.emplace(folder.slicer());
        if (options.images) frames_.emplace(folder.frames());
        if (options.images && options.truth) truth_.emplace(folder.truth(), options.truth_parts);
        if (options.images && options.dicom) {
            script::Origin origin = options.origin;
            exercise::identify(origin, simulation);
            angiograms_.emplace(folder.dicom(), *options.dicom, options.dicom_identity, origin, script,
                                options.every);
        }
        if (!options.images || !options.panel) return;
        panel_.emplace();
        panels_.emplace(folder.panel());
    }

    bool has_images() const { return frames_.has_value(); }
    void frame(const exercise::Frame& frame, const exercise::Exercise& exercise) {
        if (panel_) readout_.observe(frame, exercise.score());
        if (trace_) trace_file_->append(trace_->rows(frame, exercise.score()));
        if (markups_) markups_->take(frame);
    }
    /// Writes a frame that has an image. Returns whether `stops` said that the run is to end.
    bool image(const exercise::Frame& frame, exercise::Exercise& exercise, const render::GrayImage& image,
               const std::function<bool()>& stops) {
        frames_->accept(frame.time.index, image);
        sheet_.accept(frame.time.index, image);
        if (panel_)
            panels_->accept(frame.time.index, panel_->draw(image, frame.monitor->reference(),
                                                           readout_.read(frame, exercise.score())));
        if (angiograms_) angiograms_->take(frame, *exercise.monitor(), image);
        if (!truth_ || !frame.monitor->last_pulse()) return false;
        // The truth of large images takes longer than all else of the frame.
        const bool ends = truth_->is_slow() && stops();
        if (!ends) truth_->take(exercise, frame.time);
        return ends;
    }
    void hurry() {
        if (truth_) truth_->hurry();
    }
    void finish_images() {
        if (frames_) frames_->finish();
    }
    void finish(const RunResult& result, const script::Origin& origin) {
        if (panels_) panels_->finish();
        if (truth_) truth_->finish();
        if (angiograms_) angiograms_->finish();
        if (markups_) markups_->finish();
        if (const auto page = sheet_.page()) folder_.write_sheet(*page);
        folder_.write_score(exercise::to_json(
            {origin.program, origin.learner, result.score, result.earlier, result.benchmark}));
        folder_.keep();
    }

private:
    OutputFolder& folder_;
    Sheet sheet_;
    std::optional<PngFolder> frames_, panels_;
    std::optional<TruthFolder> truth_;
    std::optional<AngiogramFolder> angiograms_;
    std::optional<SlicerMarkups> markups_;
    std::optional<render::Panel> panel_;
    exercise::RoomReadout readout_;
    std::optional<exercise::Trace> trace_;
    std::optional<io::GrowingFile> trace_file_;
};

/// What shafts and vessels are as a run begins, where the scenario leaves it open.
std::vector<std::string> models_of(const exercise::Simulation& simulation) {
    std::vector<std::string> said;
    if (std::string vessels = simulation.vessels_sentence(); !vessels.empty())
        said.push_back("at first " + vessels);
    if (simulation.scenario().torsion != scenario::TorsionModel::Auto) return said;
    for (int k = 0; k < static_cast<int>(simulation.devices().size()); ++k)
        if (simulation.devices()[k].device.twists())
            said.push_back("at first " + simulation.torsion_sentence(k));
    return said;
}

RunResult run(exercise::Exercise& exercise, const script::CommandScript& script, Expectation& expectation,
              FolderOutputs* outputs, const RunOptions& options) {
    const bool images = outputs && outputs->has_images();
    RunResult result;
    exercise::Notices notices;
    std::vector<script::Command> commands;
    const std::vector<std::string> models = models_of(exercise.simulation());
    const int last = last_frame_of(exercise.simulation().scenario(), script);
    for (int index = 0; index <= last; ++index) {
        commands.clear();
        for (const script::TimedCommand& timed : script.at(index)) commands.push_back(timed.command);
        const exercise::Frame frame = exercise.next_frame(commands);
        notices.observe(frame);
        if (outputs) outputs->frame(frame, exercise);
        if (options.observer) options.observer(frame, exercise);
        result.frames = index + 1;
        if (expectation.knows_state(index))
            expectation.check_state(index, exercise.simulation().state_hash());
        result.interrupted = options.interrupted && index < last && options.interrupted();
        result.time_is_up = exercise.time_is_up();
        bool ends = result.interrupted || result.time_is_up;
        if (images && (shows(index, last, options.every) || ends)) {
            const render::GrayImage& image = exercise.image();
            result.interrupted |= outputs->image(frame, exercise, image, [&] {
                return result.interrupted || (options.interrupted && index < last && options.interrupted());
            });
            ends |= result.interrupted;
            expectation.check_frame(index, image);
        }
        if (options.progress) {
            options.progress({index + 1, last + 1, exercise.simulation().inserted(),
                              exercise.simulation().tip_to_target()});
        }
        if (ends) break;
    }
    if (result.interrupted && outputs) outputs->hurry();
    if (outputs) outputs->finish_images();
    result.state_hash = exercise.simulation().state_hash();
    expectation.finish(result.frames - 1, result.interrupted, images);
    result.score = exercise.finish();
    result.earlier.assign(exercise.earlier_attempts().begin(), exercise.earlier_attempts().end());
    result.benchmark = exercise.simulation().scenario().lesson.benchmark;
    result.score.interrupted = result.interrupted;
    result.compared_states = expectation.compared_states();
    result.compared_frames = expectation.compared_frames();
    result.differences = expectation.differences();
    result.notices = notices.text();
    if (images)
        for (std::string& note : exercise::patient_notes(exercise.simulation().scenario()))
            result.notices.push_back(std::move(note));
    for (const std::string& note : expectation.notes()) result.notices.push_back(note);
    if (expectation.file() != script.file)
        for (std::string& difference : other_origin(expectation.origin(), exercise.simulation()))
            result.notices.push_back(fmt::format("{}: {}", expectation.file(), difference));
    if (expectation.origin() && options.origin.program_hash != 0 && expectation.origin()->program_hash != 0 &&
        expectation.origin()->program_hash != options.origin.program_hash)
        result.notices.push_back(fmt::format("{}: it was recorded by another build of the program, {}",
                                             expectation.file(), expectation.origin()->program));
    for (std::string& difference : other_origin(script.origin, exercise.simulation()))
        result.notices.push_back(fmt::format("{}: {}", script.file, difference));
    if (result.score.pulses == 0 && result.frames > 0)
        result.notices.push_back(
            "the beam was never on: there is no image of the patient; '0 beam on' is a start");
    const scenario::Scenario& asked = exercise.simulation().scenario();
    const scenario::LumenDemand& demand = exercise.simulation().choice().demand;
    if (asked.segment_length > 2 * demand.smallest_radius) {
        result.notices.push_back(fmt::format(
            "segments of {:.3g} mm are longer than '{}' is wide, {:.3g} mm at sample {}: they "
            "can cross its wall between two joints",
            asked.segment_length, demand.narrowest, 2 * demand.smallest_radius, demand.narrowest_sample));
    }
    const anatomy::Anatomy& anatomy = exercise.simulation().anatomy();
    for (const anatomy::BlockedEnd& blocked : anatomy::blocked_ends(anatomy))
        result.notices.push_back(anatomy::text_of(anatomy, blocked));
    const scenario::ModelChoice& choice = exercise.simulation().choice();
    result.notices.insert(result.notices.end(), models.begin(), models.end());
    if (outputs)
        if (const auto error = exercise.simulation().tip_error())
            result.notices.push_back(fmt::format(
                "at the end the tip is {:.2g} mm, and the largest force on the wall {:.2g} N, from those of "
                "infinitely short segments: an estimate",
                error->tip, std::abs(error->wall_force)));
    if (asked.choose_segment_length) {
        result.notices.push_back(fmt::format("segments of {:.3g} mm were chosen: {}", choice.segment_length,
                                             choice.segment_reason));
    }
    return result;
}

/// How the origin differs from the scenario, whatever its vessels.
std::vector<std::string> other_scenario(const std::optional<script::Origin>& origin,
                                        const scenario::Scenario& here) {
    if (origin && !origin->scenario.empty() && origin->scenario != here.name)
        return {
            fmt::format("it was recorded in the scenario '{}', not in '{}'", origin->scenario, here.name)};
    if (origin && origin->scenario_hash != 0 && origin->scenario_hash != here.content)
        return {fmt::format("the scenario '{}' has changed since it was recorded", here.name)};
    return {};
}

/// `wrong`: how the script's origin differs from what it is played in.
void require_origin(const script::CommandScript& script, const RunOptions& options,
                    const std::vector<std::string>& wrong) {
    if (options.same_origin && !wrong.empty())
        throw io::InputError("{}: {}; --force goes on", script.file, io::joined(wrong, "; "));
}

exercise::Pictures pictures_of(bool images, const RunOptions& options) {
    using exercise::Pictures;
    return images ? Pictures::All : options.dose ? Pictures::Dose : Pictures::None;
}

Expectation expectation_of(const script::CommandScript& script, const RunOptions& options) {
    Expectation expectation;
    expectation.add_states(script);
    if (options.expect) expectation.add(*options.expect);
    return expectation;
}

}  // namespace

void Expectation::add_states(const script::CommandScript& script) {
    for (const script::StateCheck& check : script.checks) states_.emplace(check.frame, check);
}

void Expectation::add(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::is_directory(path, error)) {
        const script::CommandScript recording = script::load_commands(path);
        if (recording.checks.empty()) {
            throw io::InputError(path.string() +
                                 ": no 'state FRAME HASH' line was found; expected a recording, or the "
                                 "output folder of a run");
        }
        add_states(recording);
        origin_ = recording.origin;
        file_ = recording.file;
        return;
    }
    add(path / "run.gw");
    folder_ = path.string();
    had_images_ = std::filesystem::exists(path / "sheet.png", error);  // which a run without images removes
    for (const auto& entry : std::filesystem::directory_iterator(path / "frames", error)) {
        const int frame = frame_of_file_name(entry.path().filename().string());
        if (frame < 0) continue;
        read_picture(entry.path());
        frames_[frame] = entry.path();
    }
}

void Expectation::check_state(int frame, std::uint64_t hash) {
    const auto [first, last] = states_.equal_range(frame);
    for (auto at = first; at != last; ++at) {
        ++compared_states_;
        if (at->second.hash == hash) continue;
        differ(
            io::located(at->second.place, fmt::format("the state of frame {} is {}; {} was expected", frame,
                                                      io::hash_text(hash), io::hash_text(at->second.hash))));
    }
}

void Expectation::check_frame(int frame, const render::GrayImage& image) {
    const auto at = frames_.find(frame);
    if (at == frames_.end()) {
        if (!frames_.empty()) absent_.push_back(frame);
        return;
    }
    ++compared_frames_;
    seen_.insert(frame);
    const render::GrayImage expected = read_picture(at->second);
    if (expected == image) return;
    if (expected.width != image.width || expected.height != image.height) {
        differ(fmt::format("{}: frame {} has {} x {} pixels; {} x {} were expected", at->second.string(),
                           frame, image.width, image.height, expected.width, expected.height));
        return;
    }
    const render::ImageDifference found = render::difference(expected, image);
    differ(fmt::format("{}: frame {} differs at {} pixels, by {} grey levels at most", at->second.string(),
                       frame, found.pixels_differing, found.largest));
}

void Expectation::finish(int last_frame, bool interrupted, bool images) {
    if (had_images_ && frames_.empty() && images)
        differ(fmt::format("{}: its sheet.png shows that it had images, of which none are left in frames/",
                           folder_));
    else if (!folder_.empty() && frames_.empty())
        notes_.push_back(fmt::format("{}: no images were found there, so none were compared", folder_));
    else if (!frames_.empty() && !images)
        notes_.push_back(fmt::format("{}: its {} images were not compared, as this run made none", folder_,
                                     frames_.size()));
    if (images && !absent_.empty())
        differ(fmt::format("{} of the frames, frame {} first, have no image in {}", absent_.size(),
                           absent_.front(), folder_));
    if (interrupted) return;
    if (images) {
        std::vector<int> missing;
        for (const auto& [frame, file] : frames_)
            if (frame <= last_frame && !seen_.contains(frame)) missing.push_back(frame);
        if (!missing.empty())
            differ(fmt::format(
                "{} images of {}, frame {} first, were not made by this run; the same --every makes them",
                missing.size(), folder_, missing.front()));
    }
    if (last_state() > last_frame) {
        differ(fmt::format("a state is expected of frame {}; the run ended at frame {}", last_state(),
                           last_frame));
    }
    if (!frames_.empty() && frames_.rbegin()->first > last_frame) {
        differ(fmt::format("frame {} is expected; the run ended at frame {}", frames_.rbegin()->first,
                           last_frame));
    }
}

std::vector<std::string> Expectation::differences() const {
    std::vector<std::string> lines = differences_;
    if (differing_ > lines.size()) lines.push_back(fmt::format("... and {} more", differing_ - lines.size()));
    return lines;
}

void Expectation::differ(const std::string& text) {
    ++differing_;
    if (differences_.size() < most_differences) differences_.push_back(text);
}

std::vector<std::string> other_origin(const std::optional<script::Origin>& origin,
                                      const exercise::Simulation& simulation) {
    std::vector<std::string> differences = other_scenario(origin, simulation.scenario());
    if (origin && origin->anatomy_hash != 0 && origin->anatomy_hash != anatomy::hash_of(simulation.anatomy()))
        differences.push_back("the anatomy has changed since it was recorded");
    return differences;
}

void check(const scenario::Scenario& scenario, const script::CommandScript& script) {
    std::vector<std::string> wrong = scenario::problems(scenario);
    for (const std::string& problem : script::problems(script, scenario.c_arm, scenario.frame_rate))
        wrong.push_back(problem);
    for (const std::string& problem : exercise::device_problems(script, scenario)) wrong.push_back(problem);
    if (!wrong.empty()) throw io::InputError(io::joined(wrong, "\n"));
}

RunResult run_headless(const scenario::Scenario& scenario, const script::CommandScript& script,
                       const RunOptions& options) {
    check(scenario, script);
    Expectation expectation = expectation_of(script, options);
    require_origin(script, options, other_scenario(script.origin, scenario));
    exercise::Exercise exercise(scenario, pictures_of(options.images_for_observer, options), options.cache,
                                &script);
    require_origin(script, options, other_origin(script.origin, exercise.simulation()));
    return run(exercise, script, expectation, nullptr, options);
}

RunResult run_headless(const scenario::Scenario& scenario, const script::CommandScript& script,
                       const std::filesystem::path& out, const RunOptions& options) {
    check(scenario, script);
    refuse_to_overwrite(out, script.file, options.expect);
    std::vector<std::filesystem::path> inputs = scenario::inputs_of(scenario);
    inputs.push_back(script.file);
    inputs.insert(inputs.end(), options.also_read.begin(), options.also_read.end());
    if (options.expect && std::filesystem::is_directory(*options.expect))
        inputs.insert(inputs.end(), {*options.expect / "run.gw", *options.expect / "frames"});
    else if (options.expect)
        inputs.push_back(*options.expect);
    refuse_to_replace(inputs, out, options.trace);
    Expectation expectation = expectation_of(script, options);
    OutputFolder folder(out,
                        {options.images, options.images && options.panel, options.images && options.truth,
                         options.images && options.dicom, options.slicer});
    if (!options.trace.empty()) io::require_writable(options.trace);
    anatomy::ModelCache cache = options.cache;
    if (cache.folder.empty()) cache.folder = anatomy::cache_beside(out);
    require_origin(script, options, other_scenario(script.origin, scenario));
    exercise::Exercise exercise(scenario, pictures_of(options.images, options), cache, &script);
    require_origin(script, options, other_origin(script.origin, exercise.simulation()));

    folder.take_out_earlier_run();
    FolderOutputs outputs(folder, options, last_frame_of(scenario, script), scenario.frame_rate,
                          exercise.simulation(), script);
    exercise.record(folder.recording(), {options.origin, options.hash_every});
    const RunResult result = run(exercise, script, expectation, &outputs, options);
    exercise.close_recording();
    outputs.finish(result, options.origin);
    return result;
}

}  // namespace run
