#include "engine/scenario/benchmark.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <numeric>
#include <toml++/toml.h>

#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"

namespace scenario {
namespace {

constexpr double most_attempts = 1000, largest = 1e6;

void read_sample(io::Section& section, const BenchmarkFigure& figure, Benchmark& into) {
    const toml::node* node = section.find(figure.key);
    if (!node) return;
    const toml::array* array = node->as_array();
    std::vector<double> values;
    bool good = array && array->size() == static_cast<std::size_t>(into.attempts);
    for (std::size_t k = 0; good && k < array->size(); ++k) {
        const std::optional<double> value = (*array)[k].value<double>();
        good = value && *value >= 0 && *value <= largest;
        if (good) values.push_back(*value);
    }
    if (!good)
        return section.refuse(
            figure.key, *node,
            fmt::format("{} numbers from 0 to {:g}, one for each attempt", into.attempts, largest));
    (into.*figure.sample).values = std::move(values);
}

Benchmark read_benchmark(io::Section section, const std::string& file) {
    Benchmark read;
    read.file = file;
    if (!section.word("by", read.by)) section.missing("by", "by = \"WHO MADE THE ATTEMPTS\"");
    if (section.find("attempts"))
        section.whole("attempts", read.attempts, {1, most_attempts});
    else
        section.missing("attempts", "attempts = NUMBER");
    std::string hash;
    if (section.word("scenario", hash)) {
        if (const auto known = io::parse_hash(hash))
            read.scenario = *known;
        else
            section.refuse("scenario", *section.find("scenario"), "16 digits of a hash");
    }
    for (const BenchmarkFigure& figure : benchmark_figures()) read_sample(section, figure, read);
    section.finish();
    return read;
}

}  // namespace

double Sample::mean() const {
    return values.empty() ? 0 : std::accumulate(values.begin(), values.end(), 0.0) / values.size();
}

double Sample::spread() const {
    if (values.size() < 2) return 0;
    const double middle = mean();
    double sum = 0;
    for (const double value : values) sum += (value - middle) * (value - middle);
    return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

double Sample::least() const {
    return values.empty() ? 0 : *std::ranges::min_element(values);
}

const std::vector<BenchmarkFigure>& benchmark_figures() {
    static const std::vector<BenchmarkFigure> all = {
        {"completed_after_s", &Benchmark::completed_after},
        {"air_kerma_mGy", &Benchmark::air_kerma},
        {"kerma_area_product_Gy_cm2", &Benchmark::area_product},
        {"contrast_ml", &Benchmark::contrast},
        {"wire_travel_mm", &Benchmark::wire_travel},
        {"wrong_entries", &Benchmark::wrong_entries},
        {"handling_errors", &Benchmark::errors},
        {"angiograms", &Benchmark::angiograms},
        {"residual_percent", &Benchmark::residual},
    };
    return all;
}

Benchmarks parse_benchmarks(const std::string& text, const std::string& file) {
    io::ParseContext reading{file, {}, {}};
    const toml::table root = reading.parse(text);
    io::Section top(reading, &root, "");
    top.schema();
    Benchmarks read;
    for (const auto& [key, node] : root)
        if (key.str() != "schema")
            read[std::string(key.str())] = read_benchmark(top.section(key.str(), true), file);
    top.finish();
    reading.end();
    return read;
}

Benchmarks load_benchmarks(const std::filesystem::path& path) {
    return parse_benchmarks(io::read_text(path, "benchmark", "expected a file named benchmark.toml"),
                            path.string());
}

std::string to_toml(const Benchmarks& benchmarks) {
    std::string text =
        "# What skilled attempts at these exercises came to: the measure of all others. Made by 'seldinger "
        "benchmark'.\nschema = 1\n";
    for (const auto& [name, benchmark] : benchmarks) {
        text += fmt::format("\n[{}]\nby = {}\nattempts = {}\n", io::toml_key(name),
                            io::toml_text(benchmark.by), benchmark.attempts);
        if (benchmark.scenario != 0)
            text += fmt::format("scenario = \"{}\"\n", io::hash_text(benchmark.scenario));
        for (const BenchmarkFigure& figure : benchmark_figures())
            if (const Sample& sample = benchmark.*figure.sample; sample.given())
                text += fmt::format("{} = [{}]\n", figure.key, fmt::join(sample.values, ", "));
    }
    return text;
}

Benchmark benchmark_in(const std::filesystem::path& folder, const std::string& name) {
    const std::filesystem::path file = folder / benchmark_file;
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) return {};
    const Benchmarks all = load_benchmarks(file);
    const auto found = all.find(name);
    return found == all.end() ? Benchmark() : found->second;
}

}  // namespace scenario
