#pragma once
/// Claims as files and tables, and how many there are of each class.

#include <span>
#include <string>
#include <vector>

#include "engine/studies/study.h"

namespace studies {

/// The class of a claim: "reproduced" or "differs" for one of the paper that could have failed, else
/// "calibrated", "identity", "machine" or "extension".
std::string class_of(const Claim&);

/// Adds claims of one figure to a study's.
class FigureClaims {
public:
    FigureClaims(StudyResult& result, std::string figure, const std::string& note = {})
        : claims_(result.claims), figure_(std::move(figure)) {
        if (!note.empty()) result.notes.push_back({figure_, note});
    }
    /// A statement of the paper that could fail. `rule` says when it holds; `why` is what a reader must know
    /// where it does not: the reason and what shows it.
    void published(std::string text, io::TableCell published, io::TableCell measured, bool holds,
                   std::string rule, std::string why = {}) {
        add(ClaimKind::Published, std::move(text), std::move(published), std::move(measured), holds,
            std::move(rule), std::move(why));
    }
    /// An identity: a number that follows from the size of the scenes alone. At full size it is held against
    /// the published one, in a quick run against what that run's own size makes of it, `here`, by the same
    /// share `within` of it.
    void counted(bool quick, std::string text, double published, double here, double measured, double within,
                 const std::string& rule, std::string note = {});
    void add(ClaimKind kind, std::string text, io::TableCell published, io::TableCell measured, bool holds,
             std::string rule, std::string note = {}) {
        claims_.push_back({std::move(text), std::move(published), std::move(measured), holds, std::move(note),
                           kind, std::move(rule), figure_});
    }

private:
    std::vector<Claim>& claims_;
    std::string figure_;
};

/// The claims of one study.
struct ClaimList {
    std::string study;
    std::span<const Claim> claims;
    std::span<const std::pair<std::string, std::string>> notes = {};  // of a figure
};

/// How many claims a class has, and how many of them hold.
struct ClaimCount {
    int claims = 0, holding = 0;
};
/// By class; every class is there, in the order reproduced, differs, calibrated, identity, machine,
/// extension.
std::vector<std::pair<std::string, ClaimCount>> claim_counts(std::span<const ClaimList>);

/// {"counts": {CLASS: {claims, holding}}, "claims": [{study, figure, class, text, published, measured, holds,
/// rule, note}]}. Claims of processor times are listed; their count says nothing of which hold. A number that
/// is not finite is null.
std::string claims_json(std::span<const ClaimList>);

/// The claims of one figure as a table: claim, published, measured, verdict, how it can fail, note.
io::Table claims_table(std::span<const Claim>, const std::string& figure);

/// The figures that claims name, in their order.
std::vector<std::string> figures_of(std::span<const Claim>);

/// A page of a study of the paper: heading, how it was made, `introduction`, pictures with their captions,
/// then the claims figure by figure, each with its note.
std::string claims_page(std::string_view id, const std::string& title, const std::string& introduction,
                        const StudyResult&, const StudyOptions&);

}  // namespace studies
