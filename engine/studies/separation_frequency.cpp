#include <algorithm>
#include <array>
#include <fmt/format.h>

#include "engine/studies/claims.h"
#include "engine/studies/paper_scene.h"
#include "engine/studies/runs.h"
#include "engine/studies/templates.h"
#include "engine/studies/work.h"
#include "physics/relax/segment_relaxer.h"

namespace studies {
namespace {

constexpr int least_separation = physics::least_separation, largest_separation = physics::largest_separation;
constexpr int most_varied = 4;  // varied segments, at most
constexpr const char* separation_frequency_colours[] = {"#0072B2", "#E69F00", "#009E73"};

/// How often each separation was chosen; [m] is δ_{m+1}.
struct Frequencies {
    std::array<std::array<long long, largest_separation + 1>, most_varied - 1> counts{};
    long long updates = 0;

    double percent(int m, int delta) const {
        long long all = 0;
        for (const long long count : counts[m]) all += count;
        return all > 0 ? 100.0 * static_cast<double>(counts[m][delta]) / static_cast<double>(all) : 0.0;
    }
    int most_frequent(int m) const {
        return static_cast<int>(std::max_element(counts[m].begin(), counts[m].end()) - counts[m].begin());
    }
};

Frequencies count(const PaperScene& scene, int varied_segments, int cycles) {
    Frequencies result;
    physics::SegmentRelaxer relaxer(paper_method(varied_segments).config, *scene.wall);
    physics::Chain wire = scene.start;
    const auto report =
        relaxer.relax(wire, physics::whole_cycles(wire.segments(), cycles), [&](int, const physics::Chain&) {
            const auto varied = relaxer.last_varied();
            for (std::size_t m = 1; m < varied.size(); ++m) ++result.counts[m - 1][varied[m] - varied[m - 1]];
        });
    result.updates = report.updates;
    return result;
}

/// Largest rise of the frequency from one separation strictly inside [5, 25] to a larger one, in percent of
/// all choices. The ends also take what lies beyond them.
double largest_rise(const Frequencies& f, int m) {
    double least = 100, rise = 0;
    for (int delta = least_separation + 1; delta < largest_separation; ++delta) {
        rise = std::max(rise, f.percent(m, delta) - least);
        least = std::min(least, f.percent(m, delta));
    }
    return rise;
}

/// Spearman's rank correlation of frequency and separation inside [5, 25]: −1 where it falls all the way.
double fall(const Frequencies& f, int m) {
    constexpr int count = largest_separation - least_separation - 1;
    std::array<int, count> order{};
    for (int k = 0; k < count; ++k) order[k] = least_separation + 1 + k;
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return f.percent(m, a) < f.percent(m, b); });
    double squares = 0;
    for (int rank = 0; rank < count; ++rank) {
        const double off = rank - (order[rank] - least_separation - 1);
        squares += off * off;
    }
    return 1 - 6 * squares / (count * (count * count - 1.0));
}

/// Separations strictly inside [5, 25] that are chosen more often than both neighbours, by at least a tenth.
std::string peaks(const Frequencies& f, int m) {
    std::string list;
    for (int delta = least_separation + 1; delta < largest_separation; ++delta) {
        const double here = f.percent(m, delta);
        if (here > 1.1 * f.percent(m, delta - 1) && here > 1.1 * f.percent(m, delta + 1))
            list += fmt::format("{}{}", list.empty() ? "" : ", ", delta);
    }
    return list.empty() ? "none" : list;
}

void claim(StudyResult& result, const std::vector<Frequencies>& all, const std::vector<Frequencies>& other,
           const std::string& other_name) {
    const Frequencies &two = all[0], &three = all[1], &four = all[2];
    FigureClaims fig(
        result, "Fig. 9",
        "Of all choices in the cycles. The two ends, 5 and 25, also take every choice that would lie beyond "
        "them, so that what the paper says of \"between the extremes\" is asked of 6 to 24.");
    const double at_5 = two.percent(0, least_separation), at_25 = two.percent(0, largest_separation);
    fig.published("with M = 2, δ1 = 5 is chosen somewhat more often than δ1 = 25 [%]", "somewhat more often",
                  fmt::format("{:.1f} against {:.1f}", at_5, at_25), at_5 > at_25,
                  "5 is chosen more often than 25");
    fig.published(
        "with M = 2 the frequency falls between the extremes: largest rise to a larger δ1 [%]", 0.0,
        largest_rise(two, 0), largest_rise(two, 0) <= 0, "there is no rise among 6 to 24",
        fmt::format("The frequency has a minimum inside: rank correlation with δ1 {:.2f}, and {:.2f} on {} "
                    "(rise {:.2f}); it has one on every tube tried. Which separations pay is decided by the "
                    "distance between contacts, which the published tube's is not known.",
                    fall(two, 0), fall(other[0], 0), other_name, largest_rise(other[0], 0)));
    const std::string of_three = peaks(three, 0) + "; " + peaks(three, 1),
                      of_four = peaks(four, 0) + "; " + peaks(four, 1) + "; " + peaks(four, 2);
    const auto has_peak = [](const std::string& text) {
        return text.find_first_of("0123456789") != std::string::npos;
    };
    fig.published("with M = 3 and M = 4 some peaks appear: at δ1; δ2; δ3", "some",
                  fmt::format("M = 3: {}, M = 4: {}", of_three, of_four),
                  has_peak(of_three) && has_peak(of_four),
                  "with each M some separation inside is chosen a tenth more often than both neighbours",
                  fmt::format("None at the paper's heights; on {}: M = 3: {}; {}. Peaks are the distances "
                              "between the tube's own contacts.",
                              other_name, peaks(other[1], 0), peaks(other[1], 1)));
    fig.published(
        "the frequency of δ2 = 5 is large: M = 3, M = 4 [%]", "large",
        fmt::format("{:.1f}, {:.1f}", three.percent(1, least_separation), four.percent(1, least_separation)),
        three.most_frequent(1) == least_separation && four.most_frequent(1) == least_separation,
        "it is the most frequent δ2 with both",
        fmt::format("The most frequent are {} and {}.", three.most_frequent(1), four.most_frequent(1)));
}

}  // namespace

StudyResult run_separation_frequency(const StudyOptions& options) {
    const int cycles = options.quick ? 10 : 100;
    const int n = options.quick ? 100 : 200;
    const PaperScene scene = paper_scene("sharp", {.segments = n}),
                     other = paper_scene("sinuous", {.segments = n});
    constexpr int each = most_varied - 1;
    std::vector<Frequencies> all(2 * each);
    Work work(options, 2 * each);
    work.run(2 * each, [&](int k) {
        const PaperScene& tube = k < each ? scene : other;
        all[k] = count(tube, 2 + k % each, cycles);
        return fmt::format("M = {}, {}", 2 + k % each, tube.name);
    });
    const std::vector<Frequencies> of_other(all.begin() + each, all.end());
    all.resize(each);
    StudyResult result;
    io::Table table{"separation_frequency",
                    {"varied_segments", "index", "separation", "chosen_percent", "count"}};
    for (int m = 2; m <= most_varied; ++m)
        for (int k = 0; k < m - 1; ++k)
            for (int delta = least_separation; delta <= largest_separation; ++delta)
                table.add({m, k + 1.0, delta, all[m - 2].percent(k, delta), all[m - 2].counts[k][delta]});
    claim(result, all, of_other, other.name);
    result.plots = {
        filled_plot("separation_frequency", 900, 860, {{"cycles", cycles}, {"scene", scene.text()}})};
    result.page =
        filled_page("separation-frequency", {{"cycles", cycles}, {"scene", scene.text()}}, result, options);
    result.tables = {std::move(table)};
    return result;
}

}  // namespace studies
