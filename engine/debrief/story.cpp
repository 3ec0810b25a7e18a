#include "engine/debrief/story.h"

#include <algorithm>
#include <map>

#include "engine/run/headless.h"
#include "physics/wire/energy.h"
#include "render/picture/png.h"

namespace debrief {
namespace {

Moment moment_of(const exercise::Frame& frame) {
    const exercise::Simulation& simulation = frame.simulation;
    Moment m;
    m.frame = frame.time.index;
    m.seconds = frame.time.seconds;
    for (const scenario::PlacedDevice& placed : simulation.devices()) {
        m.inserted.push_back(simulation.inserted(placed.role));
        m.turned += simulation.hand(placed.role).turned;
    }
    m.force = physics::largest_force(simulation.contacts());
    m.injection = simulation.contrast().injection_rate();
    m.to_target = simulation.tip_to_target();
    m.beam = simulation.console().beam_on();
    m.dsa = simulation.console().mode() == script::ImagingMode::Dsa;
    m.tip = simulation.tip();
    return m;
}

/// The frames worth a picture, with what each shows: what the teacher said of the first of them, where errors
/// began, spread over them where there are too many, and the last.
std::map<int, std::string> key_frames_of(const Story& story) {
    std::map<int, std::string> captions;
    for (const script::Comment& comment : story.comments)
        if (captions.size() < most_key_frames / 2)
            captions.try_emplace(comment.frame, "The teacher: " + comment.text);
    const auto& marks = story.score.handling_errors;
    const std::size_t room = most_key_frames - 1 - captions.size();
    const std::size_t shown = std::min(room, marks.size());
    for (std::size_t k = 0; k < shown; ++k) {
        const exercise::HandlingErrorMark& mark = marks[shown == marks.size() ? k : k * marks.size() / shown];
        captions.try_emplace(mark.first, exercise::handling_error_texts[static_cast<std::size_t>(mark.kind)]);
    }
    if (!story.moments.empty())
        captions.try_emplace(story.moments.back().frame,
                             story.score.completed ? "The end: target reached" : "The end");
    return captions;
}

}  // namespace

std::optional<Story> tell(const scenario::Scenario& scenario, const script::CommandScript& recording,
                          const StoryOptions& options) {
    Story story;
    story.file = recording.file;
    story.origin = recording.origin.value_or(script::Origin());
    run::RunOptions played;
    played.images = false;
    played.same_origin = options.same_origin;
    played.cache = options.cache;
    played.interrupted = options.interrupted;
    if (options.progress)
        played.progress = [&](const run::Progress& p) {
            options.progress(static_cast<double>(p.frame) / p.frames, "playing the recording");
        };
    played.observer = [&](const exercise::Frame& frame, exercise::Exercise& exercise) {
        if (story.branches.empty()) {
            story.branches = exercise.simulation().anatomy().branches;
            story.target = exercise.simulation().target();
        }
        if (frame.motion.reset) story.moments.clear();
        story.moments.push_back(moment_of(frame));
    };
    const run::RunResult result = run::run_headless(scenario, recording, played);
    if (result.interrupted) return std::nullopt;
    story.scenario = scenario;
    story.score = result.score;
    if (!story.moments.empty())
        for (const script::Comment& comment : recording.comments)
            (comment.frame < story.moments.front().frame ? story.comments_before : story.comments)
                .push_back(comment);
    story.earlier = result.earlier;
    story.differences = result.differences;
    story.notices = result.notices;
    if (!options.images || result.score.pulses == 0) return story;

    const std::map<int, std::string> wanted = key_frames_of(story);
    played.images_for_observer = true;
    played.observer = [&](const exercise::Frame& frame, exercise::Exercise& exercise) {
        const auto at = wanted.find(frame.time.index);
        if (at == wanted.end() || !frame.monitor->last_pulse()) return;
        story.key_frames.push_back({at->first, at->second, render::encode_png(exercise.image())});
    };
    if (options.progress)
        played.progress = [&](const run::Progress& p) {
            options.progress(static_cast<double>(p.frame) / p.frames, "taking pictures");
        };
    const run::RunResult pictured = run::run_headless(scenario, recording, played);
    if (pictured.interrupted) return std::nullopt;
    story.score.air_kerma = pictured.score.air_kerma;
    story.score.area_product = pictured.score.area_product;
    return story;
}

}  // namespace debrief
