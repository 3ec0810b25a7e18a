#pragma once
/// How responsive the window was, for --measure.

#include <filesystem>
#include <optional>
#include <vector>

namespace app {

class Measure {
public:
    void interface(double ms) { interface_.push_back(ms); }
    void latency(double ms) { latency_.push_back(ms); }
    /// Of one drawing of the teacher's window, during which the trainee's is not drawn.
    void teacher(double ms) { teacher_.push_back(ms); }
    /// From a view to the end of its drawing in the trainee's window.
    void shown(double ms) { shown_.push_back(ms); }
    void first_image(double seconds) {
        if (!first_) first_ = seconds;
    }
    /// Writes JSON. Throws io::InputError.
    void write(const std::filesystem::path&, int frames, int lost) const;

private:
    std::vector<double> interface_, latency_, teacher_, shown_;  // [ms]
    std::optional<double> first_;                                // [s]
};

}  // namespace app
