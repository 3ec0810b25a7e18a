#pragma once
/// What a study leaves in its folder.

#include <filesystem>
#include <string>
#include <vector>

#include "engine/studies/study.h"

namespace studies {

/// Writes tables, page, claims and pictures. Returns notices, such as a missing picture. Throws InputError.
std::vector<std::string> write_study(const Study&, const StudyResult&, const std::filesystem::path& out);

/// One HTML page of all pictures with their captions, and the claims.
std::string studies_html(const std::vector<std::pair<const Study*, StudyResult>>&, bool quick);

}  // namespace studies
