#pragma once
/// What skilled attempts at an exercise came to: the measure of all others (proficiency-based training: the
/// mean of experts). `benchmark.toml` in the folder of exercises has a table for each; `seldinger benchmark`
/// makes it of recordings.
///
///     schema = 1
///     [renal]
///     by = "Dr N., Dr M., vascular surgeons, 2 attempts each"
///     attempts = 4
///     scenario = "0123456789abcdef"              # what they were made in, as recordings state it
///     completed_after_s = [21.4, 19.0, 24.1, 20.2]
///     air_kerma_mGy = [17.0, 18.4, 16.1, 17.7]
///     ...

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace scenario {

/// The values of one figure, an attempt each.
struct Sample {
    std::vector<double> values;

    bool given() const { return !values.empty(); }
    double mean() const;
    /// Standard deviation, of n − 1; 0 for fewer than two values.
    double spread() const;
    double least() const;
};

struct Benchmark {
    std::string by;              // who made the attempts, and how, in words
    int attempts = 0;            // all of which reached the target; 0 = there is no benchmark
    std::uint64_t scenario = 0;  // Scenario::content of what was played
    std::string file;            // that it was read from
    // One value an attempt; a figure that nobody measured has none.
    Sample completed_after;  // from the start of the attempt to the end of the hold [s]
    Sample air_kerma;        // K_a,r at the reference point [mGy]
    Sample area_product;     // P_KA [Gy·cm²]
    Sample contrast;         // [ml]
    Sample wire_travel;      // of all devices [mm]
    Sample wrong_entries;    // into branches that do not lead to the target
    Sample errors;           // of handling, without injuries
    Sample angiograms;       // injections seen by the beam
    Sample residual;         // stenosis of the worst lesion, 0 where it is wider than its vessel [percent]

    bool given() const { return attempts > 0; }
};

/// The figures of a benchmark as its file names them, in the file's order.
struct BenchmarkFigure {
    std::string_view key;
    Sample Benchmark::*sample;
};
const std::vector<BenchmarkFigure>& benchmark_figures();

inline constexpr const char* benchmark_file = "benchmark.toml";

/// By the name of the scenario. Throws InputError that lists everything wrong, a line each.
using Benchmarks = std::map<std::string, Benchmark>;
Benchmarks parse_benchmarks(const std::string& toml, const std::string& file);
Benchmarks load_benchmarks(const std::filesystem::path&);
/// The file's text; reading it gives the same values to the bit.
std::string to_toml(const Benchmarks&);

/// The one of this name in the `benchmark.toml` of the folder; not given() where there is none. Throws
/// InputError for a file that cannot be used.
Benchmark benchmark_in(const std::filesystem::path& folder, const std::string& name);

}  // namespace scenario
