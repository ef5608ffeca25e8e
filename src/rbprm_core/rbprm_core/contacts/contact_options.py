"""Options of the contact planners."""

from __future__ import annotations

from dataclasses import dataclass, field

from rbprm_core.contacts.along_guide.options import GeneratorOptions, SequenceOptions


@dataclass(frozen=True)
class ContactOptions:
    """Options of the contact planners (P2).

    Attributes:
        generator: options of the contact generator.
        sequence: options of the steps along the guide.
    """

    generator: GeneratorOptions = field(default_factory=GeneratorOptions)
    sequence: SequenceOptions = field(default_factory=SequenceOptions)
