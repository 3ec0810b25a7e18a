#include "app/play/glossary.h"

#include <algorithm>
#include <cctype>
#include <map>

namespace app {

// Made of docs/glossary.md by the build.
extern const std::map<std::string_view, std::string_view> glossary_page;

namespace {

struct Name {
    std::string lower, term, meaning;
};

std::string lower(std::string_view text) {
    std::string made(text);
    for (char& c : made) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return made;
}

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    return text;
}

/// Rows are "| Name, other name (abbreviation) | Meaning |"; the longest names come first.
std::vector<Name> names_of(std::string_view page) {
    std::vector<Name> names;
    while (!page.empty()) {
        const std::size_t end = std::min(page.find('\n'), page.size());
        std::string_view row = page.substr(0, end);
        page.remove_prefix(std::min(end + 1, page.size()));
        const std::size_t bar = row.find('|', 1);
        if (row.substr(0, 2) != "| " || bar == std::string_view::npos) continue;
        std::string_view terms = trimmed(row.substr(1, bar - 1));
        std::string_view meaning = row.substr(bar + 1);
        meaning = trimmed(meaning.substr(0, meaning.rfind('|')));
        const std::string whole(terms);
        while (!terms.empty()) {
            const std::size_t cut = std::min({terms.find(", "), terms.find(" ("), terms.size()});
            std::string_view name = trimmed(terms.substr(0, cut));
            terms.remove_prefix(std::min(cut + 2, terms.size()));
            if (!name.empty() && name.back() == ')') name.remove_suffix(1);
            if (!name.empty()) names.push_back({lower(name), whole, std::string(meaning)});
        }
    }
    std::stable_sort(names.begin(), names.end(),
                     [](const Name& a, const Name& b) { return a.lower.size() > b.lower.size(); });
    return names;
}

bool is_part_of_word(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || (c & 0x80);
}

}  // namespace

std::vector<GlossaryWord> glossary_words(std::string_view text) {
    static const std::vector<Name> names = names_of(glossary_page.at("glossary.md"));
    const std::string low = lower(text);
    std::vector<GlossaryWord> found;
    for (const Name& name : names)
        for (std::size_t at = low.find(name.lower); at != std::string::npos;
             at = low.find(name.lower, at + 1)) {
            std::size_t end = at + name.lower.size();
            if (end < low.size() && low[end] == 's') ++end;  // of the plural
            if ((at > 0 && is_part_of_word(low[at - 1])) || (end < low.size() && is_part_of_word(low[end])))
                continue;
            const bool taken = std::any_of(found.begin(), found.end(), [&](const GlossaryWord& other) {
                return at < other.end && other.begin < end;
            });
            if (!taken) found.push_back({at, end, name.term, name.meaning});
        }
    std::sort(found.begin(), found.end(),
              [](const GlossaryWord& a, const GlossaryWord& b) { return a.begin < b.begin; });
    return found;
}

}  // namespace app
