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
    m.pulse = frame.motion.console.pulse;
    if (const exercise::Inflation* inflation = simulation.treatment().inflation())
        m.balloon = inflation->pressure;
    m.lumen = exercise::narrowest_lumen(simulation);
    m.iodine = exercise::iodine_in_lesion(simulation);
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

/// The frames before the first inflation, or before the first of a stent leaves its sheath, and after the
/// last one, that show the lesion best: by contrast, else the last image. None where one of them is missing.
struct TreatedFrames {
    std::vector<int> frames;
    bool of_contrast = false;
};
TreatedFrames treated_frames_of(const Story& story) {
    constexpr double shows = 20;   // of contrast [mg/ml]
    constexpr double pressed = 1;  // of a balloon [atm]
    TreatedFrames made;
    if (!story.score.treatment || story.score.treatment->lesions.empty()) return made;
    std::optional<std::size_t> first, last;  // moments with the balloon inflated
    for (std::size_t k = 0; k < story.moments.size(); ++k)
        if (const double pressure = story.moments[k].balloon.value_or(0); pressure > 0) {
            if (!first) first = k;
            if (pressure >= pressed) last = k;
        }
    for (const exercise::StentScore& stent : story.score.treatment->stents) {
        const std::size_t k = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
            stent.frame, 0, static_cast<std::ptrdiff_t>(story.moments.size()) - 1));
        first = std::min(first.value_or(k), k);
        last = std::max(last.value_or(k), k);
    }
    if (!first || !last) return made;
    struct Best {
        const Moment *contrast = nullptr, *any = nullptr;
    };
    const auto best = [&](std::size_t begin, std::size_t end) {
        Best found;
        for (std::size_t k = begin; k < end; ++k) {
            const Moment& m = story.moments[k];
            if (!m.pulse) continue;
            found.any = &m;
            if (m.iodine.value_or(0) >= shows && (!found.contrast || *m.iodine >= *found.contrast->iodine))
                found.contrast = &m;
        }
        return found;
    };
    const Best before = best(0, *first), after = best(*last + 1, story.moments.size());
    made.of_contrast = before.contrast && after.contrast;
    if (made.of_contrast)
        made.frames = {before.contrast->frame, after.contrast->frame};
    else if (before.any && after.any)
        made.frames = {before.any->frame, after.any->frame};
    return made;
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
    const TreatedFrames treated = treated_frames_of(story);
    story.of_contrast = treated.of_contrast;
    played.images_for_observer = true;
    played.observer = [&](const exercise::Frame& frame, exercise::Exercise& exercise) {
        if (!frame.monitor->last_pulse()) return;
        for (const int index : treated.frames)
            if (index == frame.time.index)
                story.treated.push_back(
                    {index, story.treated.empty() ? "before the treatment" : "after the treatment",
                     render::encode_png(exercise.image())});
        const auto at = wanted.find(frame.time.index);
        if (at == wanted.end()) return;
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
