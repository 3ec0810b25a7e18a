#include "engine/run/headless.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/exercise/exercise.h"
#include "engine/exercise/room_readout.h"
#include "engine/io/text.h"
#include "engine/run/expectation.h"
#include "engine/run/output_folder.h"
#include "engine/run/truth_files.h"
#include "render/panel/contact_sheet.h"
#include "render/panel/panel.h"

namespace run {
namespace {

constexpr double kink =
    std::numbers::pi / 3;  // bend of one joint beyond which Eq. 1 straightens it no more [rad]
constexpr int sheet_tiles = 12, sheet_columns = 4, sheet_tile_width = 256;

/// Without `end`, a run goes on long enough after its last command for the target's hold to pass.
int last_frame_of(const scenario::Scenario& scenario, const script::CommandScript& script) {
    return script.last_frame(static_cast<int>(std::ceil(scenario.target.hold * scenario.frame_rate)) + 1);
}

bool shows(int frame, int last, int every) {
    return frame % every == 0 || frame == last;
}

/// Frames that have an image, about `sheet_tiles` of them evenly spread, the first and last among them.
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

/// Takes the frames of the contact sheet and passes all on.
class Sheet {
public:
    Sheet(int last, int every, double frame_rate)
        : chosen_(sheet_frames(last, every)), frame_rate_(frame_rate) {}

    void accept(int frame, const render::GrayImage& image) {
        if (!std::binary_search(chosen_.begin(), chosen_.end(), frame)) return;
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

std::string frames(int count) {
    return fmt::format("{} frame{}", count, count == 1 ? "" : "s");
}

struct Notices {
    int stopped_withdrawals = 0, stopped_insertions = 0, used_up = 0, kinked = 0, restless = 0, crossed = 0;
    int settling = 0, refused = 0, late = 0, flat = 0;
    double deepest_crossing = 0, most_waiting = 0;  // [mm]
    void observe(const exercise::StepReport& report) {
        stopped_withdrawals += report.withdrawal_stopped;
        stopped_insertions += report.insertion_stopped;
        used_up += report.whole_wire_is_in;
        kinked += report.relax.largest_bend > kink;
        settling += report.settling;
        refused += report.refused;
        late += report.waiting_insertion != 0 || report.waiting_rotation != 0;
        most_waiting = std::max(most_waiting, std::abs(report.waiting_insertion));
        const bool moved = !report.settling && report.relax.newton_steps > 0;
        flat += moved && report.relax.at_rest && !report.relax.strict_minimum;
        restless += moved && !report.relax.at_rest;
        crossed += report.deepest_crossing > 0;
        deepest_crossing = std::max(deepest_crossing, report.deepest_crossing);
    }
    std::vector<std::string> text() const {
        std::vector<std::string> result;
        if (stopped_withdrawals > 0) {
            result.push_back(
                fmt::format("withdrawal stopped at the introducer in {}", frames(stopped_withdrawals)));
        }
        if (stopped_insertions > 0) {
            result.push_back(fmt::format("insertion stopped in {}: the tip stood in an open end",
                                         frames(stopped_insertions)));
        }
        if (used_up > 0) {
            result.push_back(
                fmt::format("insertion stopped in {}: the whole wire was in; a longer one has "
                            "another [guidewire] length_mm",
                            frames(used_up)));
        }
        if (kinked > 0) {
            result.push_back(
                fmt::format("the wire was bent by more than 60 degrees at one joint in {}: "
                            "shorter segments or a stiffer wire would follow",
                            frames(kinked)));
        }
        if (settling > 0) {
            result.push_back(fmt::format(
                "the wire was on its way at the end of {}, as in a snap: they show it where it was "
                "last at rest; more [relaxer] updates_per_frame would let it arrive",
                frames(settling)));
        }
        if (late > 0) {
            result.push_back(fmt::format(
                "the wire lagged behind the hand at the end of {}, by up to {:.2g} mm: the motion "
                "waited for the wire to come to rest",
                frames(late), most_waiting));
        }
        if (refused > 0) {
            result.push_back(fmt::format(
                "a motion was not made in {}: it led to no rest that the wire could be in", frames(refused)));
        }
        if (flat > 0) {
            result.push_back(fmt::format(
                "the wire rested at a flat minimum or a saddle in {}: another rest may be as near",
                frames(flat)));
        }
        if (restless > 0) {
            result.push_back(fmt::format(
                "the wire had not come to rest at the end of {}: a mesh's planes jump between its "
                "triangles, which a distance field does not",
                frames(restless)));
        }
        if (crossed > 0) {
            result.push_back(
                fmt::format("between two joints the wire crossed the wall, by up to {:.2g} mm, at the end of "
                            "{}; shorter segments follow the wall closer",
                            deepest_crossing, frames(crossed)));
        }
        return result;
    }
};

/// What is made of each frame besides its image.
struct Beside {
    std::function<void(const exercise::StepReport&)> frame;
    std::function<void(int frame)> image;  // where there is one
};

RunResult run(exercise::Exercise& exercise, const script::CommandScript& script, int last,
              Expectation& expectation, FrameSink* sink, Sheet* sheet, const Beside& beside,
              const RunOptions& options) {
    RunResult result;
    Notices notices;
    std::vector<script::Command> commands;
    auto next = script.commands.begin();
    for (int frame = 0; frame <= last; ++frame) {
        commands.clear();
        for (; next != script.commands.end() && next->frame == frame; ++next)
            commands.push_back(next->command);
        const exercise::StepReport report = exercise.next_frame(commands);
        notices.observe(report);
        if (beside.frame) beside.frame(report);
        result.frames = frame + 1;
        if (expectation.knows_state(frame))
            expectation.check_state(frame, exercise.simulation().state_hash());
        result.interrupted = options.interrupted && frame < last && options.interrupted();
        result.time_is_up = exercise.time_is_up();
        const bool ends = result.interrupted || result.time_is_up;
        if (sink && (shows(frame, last, options.every) || ends)) {
            const render::GrayImage& image = exercise.image();
            sink->accept(frame, image);
            if (sheet) sheet->accept(frame, image);
            if (beside.image) beside.image(frame);
            expectation.check_frame(frame, image);
        }
        if (options.progress) {
            options.progress({frame + 1, last + 1, exercise.simulation().inserted(),
                              exercise.simulation().tip_to_target()});
        }
        if (ends) break;
    }
    if (sink) sink->finish();
    result.state_hash = exercise.simulation().state_hash();
    expectation.finish(result.frames - 1, result.interrupted);
    result.score = exercise.score();
    result.score.interrupted = result.interrupted;
    result.compared_states = expectation.compared_states();
    result.compared_frames = expectation.compared_frames();
    result.differences = expectation.differences();
    result.notices = notices.text();
    const scenario::Scenario& asked = exercise.simulation().scenario();
    const scenario::LumenDemand& demand = exercise.simulation().choice().demand;
    if (asked.guidewire.segment_length > 2 * demand.smallest_radius) {
        result.notices.push_back(
            fmt::format("segments of {:.3g} mm are longer than '{}' is wide, {:.3g} mm at sample {}: they "
                        "can cross its wall between two joints",
                        asked.guidewire.segment_length, demand.narrowest, 2 * demand.smallest_radius,
                        demand.narrowest_sample));
    }
    if (asked.choose_segment_length) {
        const scenario::ModelChoice& choice = exercise.simulation().choice();
        result.notices.push_back(fmt::format("segments of {:.3g} mm were chosen: {}", choice.segment_length,
                                             choice.segment_reason));
    }
    return result;
}

void require_possible(const exercise::Simulation& simulation, const script::CommandScript& script) {
    if (const auto wrong = simulation.problems(script); !wrong.empty())
        throw io::InputError(io::joined(wrong, "\n"));
}

Expectation expectation_of(const script::CommandScript& script, const RunOptions& options) {
    Expectation expectation;
    expectation.add_states(script);
    if (options.expect) expectation.add(*options.expect);
    return expectation;
}

}  // namespace

void check(const scenario::Scenario& scenario, const script::CommandScript& script) {
    std::vector<std::string> wrong = scenario::problems(scenario);
    for (const std::string& problem : script::problems(script, scenario.c_arm, scenario.frame_rate))
        wrong.push_back(problem);
    if (!wrong.empty()) throw io::InputError(io::joined(wrong, "\n"));
}

RunResult run_headless(const scenario::Scenario& scenario, const script::CommandScript& script,
                       FrameSink* sink, const RunOptions& options) {
    check(scenario, script);
    Expectation expectation = expectation_of(script, options);
    exercise::Exercise exercise(scenario, sink != nullptr, options.cache);
    require_possible(exercise.simulation(), script);
    return run(exercise, script, last_frame_of(scenario, script), expectation, sink, nullptr, {}, options);
}

RunResult run_headless(const scenario::Scenario& scenario, const script::CommandScript& script,
                       const std::filesystem::path& out, const RunOptions& options) {
    check(scenario, script);
    refuse_to_overwrite(out, script.file, options.expect);
    Expectation expectation = expectation_of(script, options);
    anatomy::ModelCache cache = options.cache;
    if (cache.folder.empty()) cache.folder = anatomy::cache_beside(out);
    exercise::Exercise exercise(scenario, options.images, cache);
    require_possible(exercise.simulation(), script);

    OutputFolder folder(out,
                        {options.images, options.images && options.panel, options.images && options.truth});
    exercise.record(folder.recording(), {options.program, scenario.name, options.hash_every});
    const int last = last_frame_of(scenario, script);
    std::optional<PngFolder> frames;
    Sheet sheet(last, options.every, scenario.frame_rate);
    if (options.images) frames.emplace(folder.frames());
    std::optional<render::Panel> panel;
    std::optional<PngFolder> panels;
    if (options.panel && options.images) {
        panel.emplace();
        panels.emplace(folder.panel());
    }
    exercise::RoomReadout readout;
    Beside beside;
    beside.frame = [&](const exercise::StepReport& report) { readout.observe(exercise, report); };
    beside.image = [&](int frame) {
        if (panel) {
            const exercise::Monitor& monitor = *exercise.monitor();
            panels->accept(frame, panel->draw(exercise.image(), monitor.reference(), readout.read(exercise)));
        }
        if (options.truth && exercise.monitor() && exercise.monitor()->last_pulse())
            write_truth(folder.truth(), exercise.truth(), frame, scenario.frame_rate);
    };
    const RunResult result =
        run(exercise, script, last, expectation, frames ? &*frames : nullptr, &sheet, beside, options);
    exercise.close_recording();
    if (panels) panels->finish();
    if (const auto page = sheet.page()) folder.write_sheet(*page);
    folder.write_score(exercise::to_json(result.score));
    folder.keep();
    return result;
}

}  // namespace run
