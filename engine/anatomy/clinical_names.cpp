#include "engine/anatomy/clinical_names.h"

#include <algorithm>
#include <span>

namespace anatomy {
namespace {

struct Name {
    std::string_view short_form, whole;
};

constexpr Name names[] = {
    {"start", "start of the tube"},
    {"end", "end of the tube"},
    {"arch", "aortic arch"},
    {"brachiocephalic", "brachiocephalic trunk"},
    {"coeliac", "coeliac trunk"},
    {"CHA", "common hepatic artery"},
    {"splenic", "splenic artery"},
    {"SMA", "superior mesenteric artery"},
    {"IMA", "inferior mesenteric artery"},
    {"ICA", "internal carotid artery"},
    {"A1", "anterior cerebral artery (A1)"},
    {"A2", "anterior cerebral artery (A2)"},
    {"M1", "middle cerebral artery (M1)"},
    {"M2sup", "superior division of the middle cerebral artery (M2)"},
    {"M2inf", "inferior division of the middle cerebral artery (M2)"},
    {"PCOM", "posterior communicating artery"},
    {"LM", "left main coronary artery"},
    {"LAD", "left anterior descending artery"},
    {"LCX", "left circumflex artery"},
    {"D1", "first diagonal branch"},
    {"D2", "second diagonal branch"},
    {"S1", "first septal branch"},
    {"OM1", "first obtuse marginal branch"},
    {"OM2", "second obtuse marginal branch"},
    {"RCA", "right coronary artery"},
    {"conus", "conus branch"},
    {"AM", "acute marginal branch"},
    {"PDA", "posterior descending artery"},
    {"PLV", "posterior left ventricular branch"},
};

/// Of both sides: L or R stands before them.
constexpr Name sided[] = {
    {"RA", "renal artery"},
    {"CIA", "common iliac artery"},
    {"EIA", "external iliac artery"},
    {"IIA", "internal iliac artery"},
    {"CFA", "common femoral artery"},
    {"SA", "subclavian artery"},
    {"VA", "vertebral artery"},
    {"CCA", "common carotid artery"},
    {"ICA", "internal carotid artery"},
    {"ECA", "external carotid artery"},
};

std::string_view whole_form(std::span<const Name> table, std::string_view of) {
    const auto found =
        std::find_if(table.begin(), table.end(), [of](const Name& name) { return name.short_form == of; });
    return found == table.end() ? std::string_view() : found->whole;
}

std::string part_name(std::string_view part) {
    if (const std::string_view whole = whole_form(names, part); !whole.empty()) return std::string(whole);
    if (part.size() > 1 && (part[0] == 'L' || part[0] == 'R'))
        if (const std::string_view whole = whole_form(sided, part.substr(1)); !whole.empty())
            return (part[0] == 'L' ? "left " : "right ") + std::string(whole);
    return std::string(part);
}

}  // namespace

std::string clinical_name(std::string_view branch) {
    const std::size_t first = branch.find('+'), last = branch.rfind('+');
    if (first == std::string_view::npos) return part_name(branch);
    return part_name(branch.substr(0, first)) + " to " + part_name(branch.substr(last + 1));
}

std::string clinical_end(std::string_view end) {
    const std::size_t dot = end.rfind('.');
    if (dot == std::string_view::npos) return clinical_name(end);
    const std::string_view branch = end.substr(0, dot), side = end.substr(dot + 1);
    const std::size_t first = branch.find('+'), last = branch.rfind('+');
    if (side == "in") return part_name(branch.substr(0, first));
    if (side == "out") return part_name(last == std::string_view::npos ? branch : branch.substr(last + 1));
    return clinical_name(end);
}

}  // namespace anatomy
