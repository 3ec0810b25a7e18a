#pragma once
/// Claims as files and tables.

#include <span>
#include <string>

#include "engine/studies/study.h"

namespace studies {

/// A list of {text, published, measured, holds, note}; a number that is not finite is null.
std::string claims_json(std::span<const Claim>);

io::Table claims_table(std::span<const Claim>);

/// A page of a study of the paper: heading, how it was made, `introduction`, pictures with their captions,
/// then the claims.
std::string claims_page(std::string_view id, const std::string& title, const std::string& introduction,
                        const StudyResult&, const StudyOptions&);

}  // namespace studies
