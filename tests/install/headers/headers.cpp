#include "etalon/report/scene.h"
#include "etalon/runlog/json_members.h"
#include "etalon/runlog/json_reader.h"

std::string textOf(const nlohmann::json& json) { return json.dump(); }
