#pragma once
/// What an exercise is for: its place in the curriculum, what the trainee is shown, and what it is measured
/// by.

#include <optional>
#include <string>
#include <vector>

namespace scenario {

/// Figures of a good attempt; those that are empty are not graded.
struct Par {
    std::optional<double> completion_time;  // [s]
    std::optional<double> beam_on_time;     // [s]
    std::optional<double> contrast;         // [ml]
    std::optional<double> wire_travel;      // of all devices [mm]

    bool given() const { return completion_time || beam_on_time || contrast || wire_travel; }
};

/// A view that shows what matters.
struct SuggestedView {
    std::string shows;
    double lao = 0, cranial = 0;  // [rad]
};

struct Lesson {
    static constexpr int levels = 4;
    int level = 0;  // 1 to 4; 0 = outside the curriculum
    std::string briefing;
    std::vector<std::string> hints;
    std::vector<SuggestedView> views;
    Par par;
};

}  // namespace scenario
