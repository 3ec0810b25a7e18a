#include "engine/studies/forced_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <random>

#include "engine/io/text.h"
#include "engine/studies/picture_measures.h"

namespace studies {
namespace {

constexpr int side = 384, gap = 24;  // of a window, and between two [pixels]

int region_of(const std::string& name) {
    static constexpr std::array<std::array<std::string_view, 4>, 4> words = {
        {{"head", "cerebral", "skull", "brain"},
         {"cine", "coronary", "heart", "lad"},
         {"chest", "thorax", "lung", "arch"},
         {"abdomen", "pelvis", "hip", "leg"}}};
    for (std::size_t region = 0; region < words.size(); ++region)
        for (const std::string_view word : words[region])
            if (name.find(word) != std::string::npos) return static_cast<int>(region);
    return -1;
}

/// A square of that width [mm] at a place, 0 to 1 of the way from the first border to the last; means over
/// the area of each pixel.
render::Field window(const NamedPicture& picture, double width, double right, double down) {
    const double step = width / picture.pixel / side;
    const double x0 = right * (picture.grey.width - step * side),
                 y0 = down * (picture.grey.height - step * side);
    const int taps = std::max(1, static_cast<int>(std::ceil(step)));
    render::Field part(side, side);
    const auto at = [&](double x, double y) {
        const double cx = std::clamp(x - 0.5, 0.0, picture.grey.width - 1.001),
                     cy = std::clamp(y - 0.5, 0.0, picture.grey.height - 1.001);
        const auto i = static_cast<std::size_t>(cx), j = static_cast<std::size_t>(cy);
        const double u = cx - static_cast<double>(i), v = cy - static_cast<double>(j);
        const float* const p =
            picture.grey.values.data() + j * static_cast<std::size_t>(picture.grey.width) + i;
        return (1 - v) * ((1 - u) * p[0] + u * p[1]) +
               v * ((1 - u) * p[picture.grey.width] + u * p[picture.grey.width + 1]);
    };
    for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i) {
            double sum = 0;
            for (int b = 0; b < taps; ++b)
                for (int a = 0; a < taps; ++a)
                    sum += at(x0 + (i + (a + 0.5) / taps) * step, y0 + (j + (b + 0.5) / taps) * step);
            part.values[static_cast<std::size_t>(j * side + i)] = static_cast<float>(sum / (taps * taps));
        }
    return part;
}

void put(render::GrayImage& pair, const render::Field& part, int left) {
    constexpr double dark = 25, bright = 230;
    const double low = percentile(part, 0.01), high = std::max(low + 1, percentile(part, 0.99));
    for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i)
            pair.pixels[static_cast<std::size_t>(j * pair.width + left + i)] =
                static_cast<std::uint8_t>(std::clamp(
                    std::lround(dark + (bright - dark) *
                                           (part.values[static_cast<std::size_t>(j * side + i)] - low) /
                                           (high - low)),
                    0l, 255l));
}

std::string page_of(int pairs) {
    std::string html =
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Which is a "
        "patient?</title>\n<style>body{font:16px sans-serif;max-width:860px;margin:2em "
        "auto;background:#222;color:"
        "#ddd}img{width:100%}fieldset{border:0;margin:0 0 3em;padding:0}label{display:inline-block;width:49%;"
        "text-align:center;padding:.5em "
        "0}textarea{width:100%;height:8em}</style>\n</head>\n<body>\n<h1>Which is a "
        "patient?</h1>\n<p>Of each pair, one side is a part of a patient's X-ray image, the other one is "
        "computed. "
        "Choose the patient's, even where you would have to guess, in the order of the page, and say in a "
        "word "
        "what gave the other away.</p>\n<form id=\"form\">\n";
    for (int k = 1; k <= pairs; ++k)
        html += fmt::format(
            "<fieldset><legend>{0} of {1}</legend><img src=\"choice_{0:02}.png\" alt=\"pair "
            "{0}\"><br><label><input "
            "type=\"radio\" name=\"{0}\" value=\"left\"> left</label><label><input type=\"radio\" "
            "name=\"{0}\" "
            "value=\"right\"> right</label><input name=\"why{0}\" placeholder=\"why\" "
            "style=\"width:98%\"></fieldset>\n",
            k, pairs);
    return html +
           "</form>\n<button id=\"done\">My answers</button>\n<textarea id=\"answers\" readonly></textarea>\n"
           "<script>document.getElementById('done').onclick=()=>{const f=new "
           "FormData(document.getElementById('form'));let t='pair,chosen,why\\n';" +
           fmt::format("for(let k=1;k<={};++k)", pairs) +
           "t+=`${k},${f.get(k)||''},\"${(f.get('why'+k)||'').replace(/\"/g,'')}\"\\n`;"
           "document.getElementById('answers').value=t;};</script>\n</body>\n</html>\n";
}

}  // namespace

ForcedChoice forced_choice(std::span<const NamedPicture> real, std::span<const NamedPicture> own, int pairs,
                           std::uint64_t seed) {
    ForcedChoice choice;
    choice.answers = {"choice_answers", {"pair", "patient_is", "patient", "computed", "width_mm"}};
    if (real.empty() || own.empty()) return choice;
    std::mt19937_64 random(seed);
    const auto unit = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
    for (int k = 0; k < pairs; ++k) {
        const NamedPicture& patient = real[static_cast<std::size_t>(k) % real.size()];
        std::vector<const NamedPicture*> like;
        for (const NamedPicture& picture : own)
            if (region_of(picture.name) == region_of(patient.name)) like.push_back(&picture);
        if (like.empty())
            for (const NamedPicture& picture : own) like.push_back(&picture);
        const NamedPicture& computed = *like[random() % like.size()];
        // Not the whole of either: a border or a collimator would tell.
        constexpr double part = 0.45, margin = 0.12;
        const auto extent = [](const NamedPicture& p) {
            return p.pixel * std::min(p.grey.width, p.grey.height);
        };
        const double width = part * std::min(extent(patient), extent(computed));
        const auto place = [&] { return margin + (1 - 2 * margin) * unit(); };
        const bool left = random() % 2 == 0;
        render::GrayImage pair{2 * side + gap, side, std::vector<std::uint8_t>((2 * side + gap) * side, 0)};
        for (const bool is_real : {true, false}) {
            const double right = place(), down = place();
            put(pair, window(is_real ? patient : computed, width, right, down),
                is_real == left ? 0 : side + gap);
        }
        choice.pairs.push_back(
            {fmt::format("choice_{:02}", k + 1), fmt::format("Pair {}.", k + 1), std::move(pair)});
        choice.answers.add({static_cast<double>(k + 1), std::string(left ? "left" : "right"), patient.name,
                            computed.name, width});
    }
    choice.page = page_of(pairs);
    return choice;
}

}  // namespace studies
