#include "app/play/measure.h"

#include <algorithm>
#include <fmt/format.h>
#include <string>

#include "engine/io/files.h"

namespace app {
namespace {

double fraction(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    const std::size_t at = std::min(values.size() - 1, static_cast<std::size_t>(part * values.size()));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[at];
}

}  // namespace

void Measure::write(const std::filesystem::path& path, int frames, int lost) const {
    const auto part = [](const std::vector<double>& values) {
        return fmt::format("{{\"count\": {}, \"median\": {:.2f}, \"p99\": {:.2f}, \"max\": {:.2f}}}",
                           values.size(), fraction(values, 0.5), fraction(values, 0.99), fraction(values, 1));
    };
    io::write_whole(
        path, fmt::format("{{\n  \"start_to_first_image_s\": {:.2f},\n  \"key_to_image_ms\": {},\n  "
                          "\"interface_ms\": {},\n  \"view_to_screen_ms\": {},\n  "
                          "\"teacher_ms\": {},\n  \"frames\": {},\n  \"late_frames\": {}\n}}\n",
                          first_.value_or(0), part(latency_), part(interface_), part(shown_), part(teacher_),
                          frames, lost));
}

}  // namespace app
