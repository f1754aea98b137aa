"""The feasibility strip: the tempo is that of the clip, and none where the clip does not go on."""

from dataclasses import replace

import numpy as np

from robojackson.motion.certificate import Certificate
from robojackson.motion.reference_motion import ReferenceMotion
from robojackson.report.plots.feasibility_plot import feasibility_strip
from tests.report.conftest import with_stands


def test_the_stands_around_the_clip_have_no_tempo(reference: ReferenceMotion) -> None:
    stood = with_stands(reference, before=3, after=5)
    count = len(stood)
    certified = replace(stood, certificate=Certificate(np.zeros(count), np.ones(count)))
    tempo = np.asarray(feasibility_strip(certified).axes[1].lines[0].get_ydata(), float)
    np.testing.assert_allclose(tempo[3:-5], 1.0)
    assert np.isnan(np.delete(tempo, np.s_[3:-5])).all()
