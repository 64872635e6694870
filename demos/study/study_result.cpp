#include "study/study_result.h"

#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "study/fnv.h"

namespace penalty::study {
namespace {

using Json = nlohmann::ordered_json;

Json or_null(const std::optional<Real>& value) { return value ? Json(*value) : Json(); }

/// A number that is not finite is null in JSON.
Real number(const Json& value) { return value.is_null() ? std::numeric_limits<Real>::quiet_NaN() : value.get<Real>(); }

std::optional<Real> optional_number(const Json& value) {
  return value.is_null() ? std::nullopt : std::optional(value.get<Real>());
}

Json to_json(const StudyResult& result) {
  const StudyCase& c = result.which;
  return {{"id", c.id()},
          {"suite", c.suite},
          {"method", c.method},
          {"precision", c.precision},
          {"material", c.material},
          {"mesh", c.mesh},
          {"vertices", result.vertices},
          {"tetrahedra", result.tetrahedra},
          {"start", c.start},
          {"seed", c.seed},
          {"duration", c.duration},
          {"recovered", result.recovered()},
          {"rest_error", result.rest_error},
          {"rest_error_at_5s", or_null(result.rest_error_at_5s)},
          {"inverted", result.inverted},
          {"to_recover", or_null(result.to_recover)},
          {"iterations", result.iterations},
          {"end", result.end},
          {"positions_hash", result.positions_hash},
          {"cpu_seconds", result.cpu_seconds},
          {"cpu_seconds_to_recover", or_null(result.cpu_seconds_to_recover)}};
}

}  // namespace

bool StudyResult::agrees_with(const StudyResult& other) const {
  const auto lasting = [](const StudyResult& result) {
    Json json = to_json(result);
    json.erase("cpu_seconds");
    json.erase("cpu_seconds_to_recover");
    return json.dump();
  };
  return lasting(*this) == lasting(other);
}

void measure_end(StudyResult& result, const demo::ShapeMeasure& measure, const PackedVectors& x) {
  result.rest_error = measure.rest_error(x);
  result.inverted = measure.errors(x).inverted;
  Fnv hash;
  for (Eigen::Index i = 0; i < x.cols(); ++i) hash.add(x.col(i).data(), 3 * sizeof(Real));
  result.positions_hash = hash.hex();
}

std::string to_line(const StudyResult& result) { return to_json(result).dump(); }

StudyResult from_line(const std::string& line) try {
  const Json json = Json::parse(line);
  StudyResult result;
  result.which = {.suite = json.at("suite"),
                  .method = json.at("method"),
                  .precision = json.at("precision"),
                  .material = json.at("material"),
                  .mesh = json.at("mesh"),
                  .start = json.at("start"),
                  .seed = json.at("seed"),
                  .duration = json.at("duration")};
  result.vertices = json.at("vertices");
  result.tetrahedra = json.at("tetrahedra");
  result.rest_error = number(json.at("rest_error"));
  result.rest_error_at_5s = optional_number(json.at("rest_error_at_5s"));
  result.inverted = json.at("inverted");
  result.to_recover = optional_number(json.at("to_recover"));
  result.iterations = json.at("iterations");
  result.end = json.at("end");
  result.positions_hash = json.at("positions_hash");
  result.cpu_seconds = json.at("cpu_seconds");
  result.cpu_seconds_to_recover = optional_number(json.at("cpu_seconds_to_recover"));
  return result;
} catch (const nlohmann::json::exception& error) {
  throw std::runtime_error("no result of a study: " + std::string(error.what()));
}

}  // namespace penalty::study
