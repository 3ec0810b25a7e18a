#pragma once
/// What happens in an attempt, one line each, as a teacher is told of it while it happens.

#include <string>
#include <vector>

#include "engine/exercise/frame.h"
#include "engine/exercise/score.h"
#include "engine/script/command.h"

namespace room {

struct LessonEvent {
    enum class Kind {
        Error,
        Injury,
        Branch,
        Contrast,
        Run,
        Dose,
        Target,
        Patient,
        Teacher,
        Comment,
        Attempt
    };
    Kind kind = Kind::Error;
    int frame = 0;       // of the run
    double seconds = 0;  // of the attempt
    std::string what;    // "The wall was pressed hard, 1.25 N"
    std::string where;   // in clinical words: "right renal artery", "LAO 30°, CRAN 0°"; may be empty
};

/// The largest forces of an attempt [N].
struct PeakForces {
    double push = 0;  // of a hand on its device, at the introducer
    double tip = 0;   // of the wall on the tip
    double wall = 0;  // of the wall on any joint
};

class LessonLog {
public:
    /// To be called once after each frame, with the score then.
    void observe(const exercise::Frame&, const exercise::Score&);
    /// A teacher's comment on a frame that has been observed.
    void comment(const script::Comment&);
    /// Forgets what came after a frame, but for comments on it and those before. The score is that of then.
    void take_back(int frame, const exercise::Score&);

    /// In the order of frames.
    const std::vector<LessonEvent>& events() const { return events_; }
    /// Counts changes of events().
    long version() const { return version_; }
    const PeakForces& peaks() const { return peaks_; }

private:
    void add(LessonEvent::Kind, const exercise::Frame&, std::string what, std::string where = {});
    void insert(LessonEvent);
    void begin();
    void follow_errors(const exercise::Score&);
    void follow_branches(const exercise::Frame&, const exercise::Score&);
    void follow_contrast(const exercise::Frame&);
    void follow_beam(const exercise::Frame&, const exercise::Score&);
    void follow_commands(const exercise::Frame&);
    void follow_complications(const exercise::Frame&, const exercise::Score&);
    void follow_forces(const exercise::Frame&);

    std::vector<LessonEvent> events_;
    PeakForces peaks_;
    std::vector<double> amounts_;  // of the attempt's errors, as told
    std::vector<int> entries_;     // into its wrong branches, as told
    std::vector<double> ends_;     // of attempt times by frame [s]
    double given_ = 0;             // contrast before the injection that runs [ml]
    bool injects_ = false;
    int runs_ = 0, doses_ = 0;  // DSA runs and marks of dose, as told
    bool reached_ = false;
    std::size_t set_ = 0;         // complications of the attempt, as told
    std::vector<bool> relieved_;  // of each
    long version_ = 0;
};

}  // namespace room
