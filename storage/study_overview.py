"""The default query of `robojackson metrics`."""

from robojackson.rl.config.evaluate_config import TRAINED, VARIANTS
from robojackson.rl.evaluation.verdict import EASY, SHORTEST_S

TAUGHT = ", ".join(f"'{policy}'" for policy in (TRAINED, *VARIANTS))
"""The policy and its variants, whose success says nothing of how easy a motion is."""

OVERVIEW = f"""
WITH bodies AS (
    SELECT study, move, setup, seed, policy, count(*) AS rollouts, avg(survived_s) AS survived_s,
           avg(strict_success) AS strict_success, avg(skill) AS skill,
           avg(survived_s) FILTER (success = 1) < {SHORTEST_S} AS ended_early
    FROM evaluations GROUP BY ALL
), cells AS (
    SELECT study, move, setup, seed, coalesce(bool_or(ended_early), false) OR
           coalesce(max(strict_success) FILTER (policy NOT IN ({TAUGHT})) >= {EASY}, false)
           AS too_short
    FROM bodies GROUP BY ALL
)
SELECT study, move, setup, seed, rollouts, round(survived_s, 2) AS survived_s,
       CASE WHEN NOT too_short THEN round(strict_success, 3) END AS strict_success,
       CASE WHEN NOT too_short THEN round(skill, 3) END AS skill
FROM bodies JOIN cells USING (study, move, setup, seed) WHERE policy = '{TRAINED}' ORDER BY ALL
"""
"""A line a cell; success and skill are empty where its rollouts are too short to evaluate."""
