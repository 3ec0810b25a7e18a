#include "engine/scenario/lesson_file.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <sstream>
#include <toml++/toml.h>
#include <utility>

#include "engine/anatomy/grow/patient.h"
#include "engine/io/text.h"
#include "physics/geometry/vec.h"
#include "render/xray/c_arm.h"

namespace scenario {
namespace {

LessonStep read_step(io::Section step) {
    LessonStep read;
    if (!step.word("text", read.text)) step.missing("text", "text = \"WHAT IS TO BE DONE\"");
    const toml::node* node = step.find("practise");
    if (!node) {
        step.missing("practise", "practise = [\"advance\"]");
        step.finish();
        return read;
    }
    const std::span<const std::string_view> names = script::practice_names();
    const toml::array* list = node->as_array();
    if (!list || list->empty())
        step.refuse("practise", *node, "expected a list of one or more of these: " + io::joined(names));
    else
        for (const toml::node& item : *list) {
            const std::string name = item.value<std::string>().value_or("");
            const auto found = std::ranges::find(names, name);
            if (found == names.end())
                step.refuse("practise", item,
                            fmt::format("expected{}: {}", io::suggestion(name, names), io::joined(names)));
            else
                read.practise.push_back(static_cast<script::Practice>(found - names.begin()));
        }
    step.finish();
    return read;
}

/// Tables as one value: "[{branch = \"LRA\", at_mm = 12}]".
std::string inline_text(const toml::array& tables) {
    std::ostringstream text;
    for (const toml::node& item : tables) {
        text << (text.tellp() > 0 ? ", {" : "[{");
        const char* between = "";
        for (const auto& [key, value] : *item.as_table()) {
            text << std::exchange(between, ", ") << key.str() << " = ";
            value.visit([&text](const auto& of) { text << of; });
        }
        text << "}";
    }
    text << "]";
    return text.str();
}

/// Disease that this patient has, by the keys of [[anatomy.…]].
void read_disease(io::Section& patient, LessonPatient& read) {
    for (const std::string_view key :
         {"tortuosity", "stenosis", "fusiform_aneurysm", "aneurysm", "occlusion", "dissection"}) {
        const toml::node* node = patient.find(key);
        if (!node) continue;
        const toml::array* tables = node->as_array();
        if (!tables || tables->empty() || !tables->is_homogeneous(toml::node_type::table)) {
            patient.refuse(key, *node, fmt::format("expected tables as [[anatomy.{}]]", key));
            continue;
        }
        read.values.emplace_back(key, inline_text(*tables));
        std::string words(key);
        std::ranges::replace(words, '_', ' ');
        read.who += ", " + words;
    }
}

LessonPatient read_one_patient(io::Section patient) {
    LessonPatient read;
    std::uint64_t seed = 0;
    double age = 0, height = 0, weight = 0;
    std::string preset;
    patient.word("indication", read.indication);
    patient.whole("seed", seed, {1, 9e15});
    patient.number("age", age, {anatomy::youngest, anatomy::oldest});
    patient.number("height_cm", height, {anatomy::shortest / 10, anatomy::tallest / 10});
    patient.number("weight_kg", weight, {anatomy::lightest, anatomy::heaviest});
    if (patient.word("preset", preset)) read.values.emplace_back("preset", fmt::format("\"{}\"", preset));
    constexpr std::array<std::string_view, 2> sexes = {"f", "m"};
    const std::optional<std::size_t> sex = patient.choice("sex", sexes);
    if (seed == 0) patient.missing("seed", "seed = 17, the patient's number, from 1");
    read.values.emplace_back("seed", std::to_string(seed));
    if (sex) read.values.emplace_back("sex", fmt::format("\"{}\"", sexes[*sex]));
    for (const auto& [key, value] : {std::pair("age", age), {"height_cm", height}, {"weight_kg", weight}})
        if (value > 0) read.values.emplace_back(key, fmt::format("{}", value));
    read.who = sex ? (*sex == 0 ? "woman" : "man") : fmt::format("seed {}", seed);
    if (age > 0) read.who += fmt::format(", {:g}", age);
    if (!preset.empty()) read.who += fmt::format(", {}", preset);
    read_disease(patient, read);
    patient.finish();
    return read;
}

}  // namespace

LessonPatient patient_of(const Scenario& s, const std::string& word) {
    if (!s.vessels || !s.places.contains("anatomy.preset"))
        throw io::InputError(
            "'{}' has one patient, found --patient {}: a preset grows others, and it has none", s.name, word);
    if (word.starts_with("seed:")) {
        const auto seed = io::parse_integer(word.substr(5));
        if (seed && *seed >= 1)
            return {fmt::format("drawn from seed {}", *seed), "", {{"seed", std::to_string(*seed)}}};
    } else if (const auto number = io::parse_integer(word);
               number && *number >= 2 && *number <= static_cast<int>(s.lesson.patients.size()) + 1) {
        return s.lesson.patients[*number - 2];
    }
    throw io::InputError("expected a patient of '{}' from 1 to {}, or seed:17, found '{}'", s.name,
                         s.lesson.patients.size() + 1, word);
}

void read_lesson(io::Section lesson, Lesson& into) {
    lesson.whole("level", into.level, {1, Lesson::levels});
    lesson.word("indication", into.indication);
    lesson.word("briefing", into.briefing);
    if (const toml::node* node = lesson.find("hints")) {
        const toml::array* hints = node->as_array();
        if (!hints || !hints->is_homogeneous(toml::node_type::string))
            lesson.refuse("hints", *node, "expected a list of sentences");
        else
            for (const toml::node& hint : *hints) into.hints.push_back(*hint.value<std::string>());
    }
    for (io::Section& view : lesson.sections("view")) {
        SuggestedView suggested;
        view.number("lao_deg", suggested.lao, {render::ArmLimits::lao.least, render::ArmLimits::lao.most},
                    geometry::degree);
        view.number("cranial_deg", suggested.cranial,
                    {render::ArmLimits::cranial.least, render::ArmLimits::cranial.most}, geometry::degree);
        if (!view.word("shows", suggested.shows)) view.missing("shows", "shows = \"WHAT IS SEEN\"");
        view.finish();
        into.views.push_back(suggested);
    }
    for (io::Section& patient : lesson.sections("patient"))
        into.patients.push_back(read_one_patient(std::move(patient)));
    for (io::Section& step : lesson.sections("step")) into.steps.push_back(read_step(std::move(step)));
    lesson.finish();
}

}  // namespace scenario
