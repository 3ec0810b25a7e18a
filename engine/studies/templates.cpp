#include "engine/studies/templates.h"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <set>
#include <stdexcept>

#include "engine/studies/claims.h"

namespace studies {

// Made of templates/* by the build.
extern const std::map<std::string_view, std::string_view> study_templates;

namespace {

std::string_view template_text(const std::string& file) {
    const auto found = study_templates.find(file);
    if (found == study_templates.end()) throw std::logic_error(fmt::format("no template {}", file));
    return found->second;
}

std::string formatted(const TemplateValue& value, std::string_view format) {
    return std::visit(
        [&](const auto& v) -> std::string {
            if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::monostate>)
                throw std::logic_error("rows in place of a number or a text");
            else
                return fmt::format(fmt::runtime(fmt::format("{{:{}}}", format)), v);
        },
        value.value);
}

class Filler {
public:
    /// Values of the last scope come first.
    std::string fill(std::string_view text, std::vector<const TemplateValues*>& scopes) {
        std::string result;
        while (!text.empty()) {
            const std::size_t at = std::min(text.find('@'), text.size());
            result += text.substr(0, at);
            if (at == text.size()) break;
            const std::size_t end = text.find('@', at + 1);
            if (end == std::string_view::npos) throw std::logic_error("a placeholder without an end");
            const std::string_view inside = text.substr(at + 1, end - at - 1);
            text.remove_prefix(end + 1);
            if (inside.starts_with("for ")) {
                const std::string_view part = part_of(text);
                const TemplateRows& rows = value_of(inside.substr(4), scopes).rows;
                for (std::size_t k = 0; k < rows.size(); ++k) {
                    if (k > 0 && !part.ends_with('\n')) result += ", \\\n     ";
                    scopes.push_back(&rows[k]);
                    result += fill(part, scopes);
                    scopes.pop_back();
                }
            } else {
                const std::string_view name = inside.substr(0, inside.find(':'));
                result += formatted(value_of(name, scopes),
                                    inside.substr(std::min(name.size() + 1, inside.size())));
            }
        }
        return result;
    }
    void require_used(const TemplateValues& values) const {
        for (const auto& [name, value] : values) {
            if (!used_.contains(&value))
                throw std::logic_error(fmt::format("value '{}' has no placeholder", name));
            for (const TemplateValues& row : value.rows) require_used(row);
        }
    }

private:
    const TemplateValue& value_of(std::string_view name, const std::vector<const TemplateValues*>& scopes) {
        for (auto scope = scopes.rbegin(); scope != scopes.rend(); ++scope)
            for (const auto& [own, value] : **scope)
                if (own == name) return **used_.insert(&value).first;
        throw std::logic_error(fmt::format("placeholder @{}@ has no value", name));
    }
    /// What stands before the @end@ that belongs to the part; removes both.
    static std::string_view part_of(std::string_view& text) {
        int open = 1;
        for (std::size_t at = 0; (at = text.find('@', at)) != std::string_view::npos; ++at) {
            if (text.substr(at).starts_with("@for ")) ++open;
            if (!text.substr(at).starts_with("@end@") || --open > 0) continue;
            const std::string_view part = text.substr(0, at);
            text.remove_prefix(at + 5);
            return part;
        }
        throw std::logic_error("@for without @end@");
    }

    std::set<const TemplateValue*> used_;
};

std::string joined_lines(std::string text) {
    text.pop_back();
    for (std::size_t at = 0; (at = text.find("\\\n", at)) != std::string::npos;) text.erase(at, 2);
    return text;
}

}  // namespace

std::string fill(std::string_view text, const TemplateValues& values) {
    Filler filler;
    std::vector<const TemplateValues*> scopes = {&values};
    std::string result = filler.fill(text, scopes);
    filler.require_used(values);
    return result;
}

std::string filled_text(std::string_view name, const TemplateValues& values) {
    return fill(joined_lines(std::string(template_text(fmt::format("{}.md", name)))), values);
}

io::Plot filled_plot(const std::string& name, int width, int height, const TemplateValues& values) {
    // Both parts filled in one go, so that a value may stand in either.
    const std::string text = fill(template_text(name + ".gp"), values);
    io::Plot plot{name, "", width, height};
    std::size_t at = 0;
    for (; text.compare(at, 2, "# ") == 0; at = text.find('\n', at) + 1) {
        const std::size_t end = text.find('\n', at);
        plot.caption += (plot.caption.empty() ? "" : " ") + text.substr(at + 2, end - at - 2);
    }
    plot.commands = text.substr(at);
    return plot;
}

std::string filled_page(std::string_view id, const TemplateValues& values, const StudyResult& result,
                        const StudyOptions& options) {
    const std::string text = filled_text(id, values);
    const std::size_t end = text.find('\n');  // of "# title", which an empty line follows
    return claims_page(id, text.substr(2, end - 2), text.substr(end + 2), result, options);
}

}  // namespace studies
